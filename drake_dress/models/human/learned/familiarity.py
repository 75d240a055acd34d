"""Tells whether an input is like those that the network was trained on.

A normal distribution of the tokens of a few steps, in their main coordinates, gives a distance
(Mahalanobis); beyond one that hardly any training input had, the network is not asked.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.human.learned.layers import Array, Weights
from drake_dress.models.human.learned.tokens import TOKEN_SIZE

# Steps of the history that are looked at, and coordinates that are kept.
_STEPS = [0, 10, 19]
_COORDINATES = 40
# Share of training inputs that are nearer than the limit, and the factor on their distance.
_SHARE, _FACTOR = 0.999, 1.5


_FLAT = len(_STEPS) * TOKEN_SIZE
FAMILIAR_SHAPES: dict[str, tuple[int, ...]] = {
    "familiar.mean": (_FLAT,),
    "familiar.coordinates": (_FLAT, _COORDINATES),
    "familiar.limit": (1,),
}


def distance(weights: Weights, tokens: Array) -> Array:
    """Returns the distances (N,) of tokens (N,T,c), over the limit: above 1 is unfamiliar."""
    flat = tokens[:, _STEPS].reshape(tokens.shape[0], -1)
    off = (flat - weights["familiar.mean"]) @ weights["familiar.coordinates"]
    return (off * off).mean(axis=1) ** 0.5 / weights["familiar.limit"][0]


def familiar_weights(tokens: np.ndarray) -> dict[str, np.ndarray]:
    """Returns the weights of `distance` from tokens (N,T,c) of training data."""
    flat = tokens[:, _STEPS].reshape(len(tokens), -1).astype(np.float64)
    mean = flat.mean(axis=0)
    off = flat - mean
    values, vectors = np.linalg.eigh(off.T @ off / len(off))
    basis = vectors[:, -_COORDINATES:] / np.sqrt(values[-_COORDINATES:] + 1e-3)
    size = np.sqrt(((off @ basis) ** 2).mean(axis=1))
    limit = _FACTOR * np.quantile(size, _SHARE)
    return {
        "familiar.mean": mean.astype(np.float32),
        "familiar.coordinates": basis.astype(np.float32),
        "familiar.limit": np.array([limit], dtype=np.float32),
    }
