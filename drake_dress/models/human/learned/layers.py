"""Layers of the networks: functions of named weights and an array.

They work on NumPy arrays and on torch tensors alike, so that each network is written once: torch
differentiates it in training, and NumPy evaluates it in a run, which then needs no torch.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

# NumPy arrays or torch tensors.
Array = Any
Weights = Mapping[str, Array]
# Below this the logistic function is 0 in single precision; its exponential would overflow.
_LOWEST = -60.0


def namespace(array: Array) -> Any:
    """Returns the module whose functions take `array`: numpy, or torch."""
    return np if isinstance(array, np.ndarray) else sys.modules["torch"]


def like(array: np.ndarray, other: Array) -> Array:
    """Returns `array` as what `other` is, on its device: a NumPy array or a torch tensor."""
    if isinstance(other, np.ndarray):
        return array
    return namespace(other).as_tensor(array, device=other.device)


def dense(weights: Weights, name: str, x: Array) -> Array:
    """Returns x W + b over the last axis: (…,i) → (…,o)."""
    return x @ weights[f"{name}.weight"] + weights[f"{name}.bias"]


def swish(x: Array) -> Array:
    """Returns x σ(x)."""
    return x * logistic(x)


def logistic(x: Array) -> Array:
    """Returns σ(x) = 1/(1 + exp(−x))."""
    xp = namespace(x)
    return 1.0 / (1.0 + xp.exp(-xp.clip(x, _LOWEST, -_LOWEST)))


def softplus(x: Array) -> Array:
    """Returns log(1 + exp(x))."""
    xp = namespace(x)
    return xp.clip(x, 0.0, None) + xp.log1p(xp.exp(-xp.abs(x)))


def normalised(weights: Weights, name: str, x: Array) -> Array:
    """Returns x with mean 0 and variance 1 over the last axis, scaled and shifted."""
    mean = x.mean(axis=-1, keepdims=True)
    off = x - mean
    variance = (off * off).mean(axis=-1, keepdims=True)
    scaled = off / (variance + 1e-5) ** 0.5
    return scaled * weights[f"{name}.scale"] + weights[f"{name}.shift"]


def attention(
    weights: Weights, name: str, x: Array, heads: int, hidden: Array, newest: bool = False
) -> Array:
    """Returns each step's mixture of all steps that are not hidden (self-attention).

    Args:
        weights: query, key, value and output.
        name: of the layer.
        x: (B,T,c).
        heads: number of heads, a divisor of c.
        hidden: (B,T) 1 where a step is to be left out, else 0.
        newest: whether only the newest step's is wanted, (B,1,c).
    """
    xp = namespace(x)
    batch, _, width = x.shape
    size = width // heads

    def split(part: str, rows: Array) -> Array:
        made = dense(weights, f"{name}.{part}", rows).reshape(batch, -1, heads, size)
        return xp.swapaxes(made, 1, 2)

    query = split("query", x[:, -1:] if newest else x)
    key, value = split("key", x), split("value", x)
    score = query @ xp.swapaxes(key, 2, 3) / size**0.5 - 1e4 * hidden[:, None, None, :]
    share = xp.exp(score - xp.amax(score, -1)[..., None])
    share = share / share.sum(axis=-1, keepdims=True)
    mixed = xp.swapaxes(share @ value, 1, 2).reshape(batch, -1, width)
    return dense(weights, f"{name}.output", mixed)


def block(
    weights: Weights, name: str, x: Array, heads: int, hidden: Array, newest: bool = False
) -> Array:
    """Returns a transformer's layer of x (B,T,c): attention, then two dense layers (pre-norm).

    With `newest`, only the newest step's, (B,1,c).
    """
    entering = normalised(weights, f"{name}.first", x)
    mixed = attention(weights, f"{name}.attention", entering, heads, hidden, newest)
    x = (x[:, -1:] if newest else x) + mixed
    inner = swish(dense(weights, f"{name}.wide", normalised(weights, f"{name}.second", x)))
    return x + dense(weights, f"{name}.narrow", inner)


def dense_weights(
    rng: np.random.Generator, name: str, inputs: int, outputs: int, size: float = 1.0
) -> dict[str, np.ndarray]:
    """Returns drawn weights of `dense`, with variance size²/inputs, and zero bias."""
    drawn = size / inputs**0.5 * rng.normal(size=(inputs, outputs))
    return {
        f"{name}.weight": drawn.astype(np.float32),
        f"{name}.bias": np.zeros(outputs, dtype=np.float32),
    }


def norm_weights(name: str, width: int) -> dict[str, np.ndarray]:
    """Returns weights of `normalised` that change nothing."""
    return {
        f"{name}.scale": np.ones(width, dtype=np.float32),
        f"{name}.shift": np.zeros(width, dtype=np.float32),
    }


def block_weights(rng: np.random.Generator, name: str, width: int) -> dict[str, np.ndarray]:
    """Returns drawn weights of `block`."""
    weights = norm_weights(f"{name}.first", width) | norm_weights(f"{name}.second", width)
    for part in ("query", "key", "value"):
        weights |= dense_weights(rng, f"{name}.attention.{part}", width, width)
    weights |= dense_weights(rng, f"{name}.attention.output", width, width, 0.3)
    weights |= dense_weights(rng, f"{name}.wide", width, 2 * width)
    return weights | dense_weights(rng, f"{name}.narrow", 2 * width, width, 0.3)
