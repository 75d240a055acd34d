"""Tells whether an input is like those that the network was trained on.

What is looked at are the tokens of a few steps, in their main coordinates, the lengths of the
limbs, and how far the arm is bent beyond what joints allow. Each has a limit that hardly any
training input passes. Beyond any one of them the network is not asked: a mean over all would hide
that a person is seen twice as large, or with left and right exchanged.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.learned.kinematics import beyond_limits
from drake_dress.models.human.learned.layers import Array, Weights
from drake_dress.models.human.learned.tokens import LIMB_COLUMNS, TOKEN_SIZE

# Steps of the history that are looked at, and coordinates of their tokens that are kept.
_STEPS = [0, 10, 19]
_COORDINATES = 60
# Share of training inputs that are below the limit of one coordinate, and the factor on it.
_SHARE, _FACTOR = 0.9999, 1.3
_SHORTEST = 1e-3  # length that is added to those of limbs, in scaled units
_SMALLEST = 1e-3  # variance of a coordinate that counts as none

_FLAT = len(_STEPS) * TOKEN_SIZE
_MORE = len(LIMB_COLUMNS) + 1
FAMILIAR_SHAPES: dict[str, tuple[int, ...]] = {
    "familiar.mean": (_FLAT + _MORE,),
    "familiar.coordinates": (_FLAT, _COORDINATES),
    "familiar.limit": (_COORDINATES + _MORE,),
}


def distance(weights: Weights, tokens: Array) -> Array:
    """Returns the distances (N,) of tokens (N,T,c), over the limit: above 1 is unfamiliar."""
    off = _off(_features(tokens), weights["familiar.mean"], weights["familiar.coordinates"])
    return (np.abs(off) / weights["familiar.limit"]).max(axis=1)


def familiar_weights(tokens: np.ndarray) -> dict[str, np.ndarray]:
    """Returns the weights of `distance` from tokens (N,T,c) of training data."""
    features = _features(tokens)
    mean = features.mean(axis=0)
    flat = (features - mean)[:, :_FLAT]
    values, vectors = np.linalg.eigh(flat.T @ flat / len(flat))
    coordinates = vectors[:, -_COORDINATES:] / np.sqrt(values[-_COORDINATES:] + _SMALLEST)
    size = np.abs(_off(features, mean, coordinates))
    limit = _FACTOR * np.quantile(size, _SHARE, axis=0) + _SMALLEST
    return {
        "familiar.mean": mean.astype(np.float32),
        "familiar.coordinates": coordinates.astype(np.float32),
        "familiar.limit": limit.astype(np.float32),
    }


def _off(features: FloatArray, mean: FloatArray, coordinates: FloatArray) -> FloatArray:
    """Returns how far features (N,`_FLAT`+`_MORE`) are from usual (N,`_COORDINATES`+`_MORE`)."""
    off = features - mean
    return np.concatenate([off[:, :_FLAT] @ coordinates, off[:, _FLAT:]], axis=1)


def _features(tokens: np.ndarray) -> FloatArray:
    """Returns (N,`_FLAT`+`_MORE`): tokens of some steps; lengths and bend beyond limits now.

    Lengths are compared by their logarithms: half as long is as unlike as twice as long.
    """
    now = tokens[:, -1].astype(np.float64)
    limbs = [now[:, columns] for columns in LIMB_COLUMNS]
    upper, fore, _ = limbs
    lengths = [np.log(np.linalg.norm(limb, axis=1) + _SHORTEST) for limb in limbs]
    more = np.stack([*lengths, beyond_limits(upper, fore)], axis=1)
    return np.concatenate([tokens[:, _STEPS].reshape(len(tokens), -1), more], axis=1)
