"""Layers: the same in NumPy and torch, and each with the invariances that it is used for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.human.learned import layers

BATCH, STEPS, WIDTH, HEADS = 3, 7, 8, 2
seeds = st.integers(0, 2**32 - 1)
Layer = Callable[[Mapping[str, Any], Any, Any], Any]
LAYERS: dict[str, Layer] = {
    "dense": lambda w, x, hidden: layers.dense(w, "some.wide", x),
    "swish": lambda w, x, hidden: layers.swish(x),
    "logistic": lambda w, x, hidden: layers.logistic(x),
    "softplus": lambda w, x, hidden: layers.softplus(x),
    "normalised": lambda w, x, hidden: layers.normalised(w, "some.first", x),
    "attention": lambda w, x, hidden: layers.attention(w, "some.attention", x, HEADS, hidden),
    "block": lambda w, x, hidden: layers.block(w, "some", x, HEADS, hidden),
}


def drawn(seed: int) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Returns weights of a block, without zeros, an input, and which of its steps are hidden."""
    rng = np.random.default_rng(seed)
    weights = layers.block_weights(rng, "some", WIDTH)
    weights = {
        k: (v + 0.2 * rng.normal(size=v.shape)).astype(np.float32) for k, v in weights.items()
    }
    x = rng.normal(size=(BATCH, STEPS, WIDTH)).astype(np.float32)
    hidden = (rng.random((BATCH, STEPS)) < 0.4).astype(np.float32)
    hidden[:, rng.integers(STEPS)] = 0.0
    return weights, x, hidden


@pytest.mark.parametrize("name", LAYERS)
@given(seed=seeds)
@settings(max_examples=20)
def test_numpy_and_torch_agree(name: str, seed: int) -> None:
    weights, x, hidden = drawn(seed)
    tensors = {k: torch.from_numpy(v) for k, v in weights.items()}
    found = LAYERS[name](weights, x, hidden)
    other = LAYERS[name](tensors, torch.from_numpy(x), torch.from_numpy(hidden))
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, other.numpy(), rtol=1e-4, atol=1e-5)


@given(seeds)
@settings(max_examples=10)
def test_dense_layer_is_a_product_and_a_shift(seed: int) -> None:
    weights, x, _ = drawn(seed)
    w, b = weights["some.wide.weight"], weights["some.wide.bias"]
    expected = np.einsum("bti,io->bto", x, w) + b
    np.testing.assert_allclose(LAYERS["dense"](weights, x, None), expected, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("x", [-1e4, -100.0, -1.0, 0.0, 2.0, 100.0, 1e4])
def test_activations_are_what_they_are_called_and_do_not_overflow(x: float) -> None:
    single = np.array([x], dtype=np.float32)
    with np.errstate(all="raise", under="ignore"):
        share, soft, swished = (
            f(single)[0] for f in (layers.logistic, layers.softplus, layers.swish)
        )
    exact = 1.0 / (1.0 + np.exp(np.float64(-max(x, -700.0))))
    assert share == pytest.approx(exact, abs=1e-7)
    assert soft == pytest.approx(np.logaddexp(0.0, x), rel=1e-6, abs=1e-7)
    assert swished == pytest.approx(x * exact, rel=1e-6, abs=1e-6)


@given(seeds)
@settings(max_examples=30)
def test_hidden_steps_do_not_reach_the_others(seed: int) -> None:
    weights, x, hidden = drawn(seed)
    other = np.where(hidden[..., None] > 0, x + 1.0 + np.float32(seed % 7), x)
    for layer in (LAYERS["attention"], LAYERS["block"]):
        first, second = layer(weights, x, hidden), layer(weights, other, hidden)
        np.testing.assert_array_equal(first[hidden == 0.0], second[hidden == 0.0])


@given(seeds)
@settings(max_examples=30)
def test_every_visible_step_reaches_the_last_one(seed: int) -> None:
    weights, x, _ = drawn(seed)
    none = np.zeros((BATCH, STEPS), dtype=np.float32)
    before = LAYERS["attention"](weights, x, none)
    for step in range(STEPS - 1):
        changed = x.copy()
        changed[:, step] += 1.0
        after = LAYERS["attention"](weights, changed, none)
        assert (np.abs(after - before)[:, -1].max(axis=1) > 1e-6).all()


@given(seeds)
@settings(max_examples=30)
def test_attention_does_not_know_the_order_of_steps(seed: int) -> None:
    weights, x, hidden = drawn(seed)
    order = np.random.default_rng(seed).permutation(STEPS)
    straight = LAYERS["attention"](weights, x, hidden)
    permuted = LAYERS["attention"](weights, x[:, order], hidden[:, order])
    np.testing.assert_allclose(permuted, straight[:, order], rtol=1e-4, atol=1e-5)


@given(seeds, st.floats(0.1, 100.0), st.floats(-10.0, 10.0))
@settings(max_examples=30)
def test_normalised_has_mean_0_and_variance_1_whatever_scale_and_shift_come(
    seed: int, scale: float, shift: float
) -> None:
    x = np.random.default_rng(seed).normal(size=(BATCH, 64))
    weights = layers.norm_weights("some", 64)
    found = layers.normalised(weights, "some", scale * x + shift)
    np.testing.assert_allclose(found.mean(axis=-1), 0.0, atol=1e-9)
    np.testing.assert_allclose(found.std(axis=-1), 1.0, rtol=2e-3)
    np.testing.assert_allclose(found, layers.normalised(weights, "some", x), rtol=2e-3, atol=1e-6)


@given(seeds)
def test_newest_step_alone_is_that_of_all(seed: int) -> None:
    weights, x, hidden = drawn(seed)
    every = layers.block(weights, "some", x, HEADS, hidden)
    newest = layers.block(weights, "some", x, HEADS, hidden, newest=True)
    np.testing.assert_allclose(newest, every[:, -1:], rtol=1e-4, atol=1e-5)


def test_block_whose_outputs_are_zero_changes_nothing() -> None:
    weights, x, hidden = drawn(0)
    for name in ("some.attention.output", "some.narrow"):
        for part in ("weight", "bias"):
            weights[f"{name}.{part}"] *= 0.0
    np.testing.assert_array_equal(LAYERS["block"](weights, x, hidden), x)


@pytest.mark.parametrize("size", [0.1, 1.0])
def test_drawn_layer_keeps_the_size_of_what_goes_in(size: float) -> None:
    rng = np.random.default_rng(0)
    weights = layers.dense_weights(rng, "some", 400, 300, size)
    out = layers.dense(weights, "some", rng.normal(size=(50, 400)))
    assert out.std() == pytest.approx(size, rel=0.03)
    assert {v.dtype for v in weights.values()} == {np.dtype(np.float32)}
