"""The residual network: what the linear predictor misses, and how far off the sum may be.

Each channel of the tokens is reduced to a few learned averages over time; residual dense layers
follow. Three heads give the displacement that is added to the linear predictor's, the scale of the
error that is left, and the radius that nine of ten errors stay within, for each joint and step: an
arm that may or may not begin to move has a small error mostly, and a wide region. Where all joints
are seen, row 0 takes the noise of the newest observation back; where one is hidden, it corrects its
filled-in place.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.human.learned.layers import (
    Array,
    Weights,
    dense,
    dense_weights,
    like,
    namespace,
    norm_weights,
    normalised,
    softplus,
    swish,
)
from drake_dress.models.human.learned.tokens import TOKEN_SIZE

HISTORY, FUTURE = 20, 20  # samples
PERIOD = 0.1  # s
FEWEST = 5  # samples in which anything was seen, of each history that was trained on
COVERED = 0.9  # share of errors in the regions
AVERAGES = 8
WIDTH = 256
_BLOCKS = ("first", "second", "third", "fourth")
_JOINTS = 3
# Smallest scale of an error, m.
_SMALLEST = 0.001
# Outputs grow with the horizon, as errors do: scale of each row.
_GROWTH = np.sqrt(0.05 + np.arange(FUTURE + 1) / FUTURE).astype(np.float32)


def motion_weights(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Returns drawn weights; the network then returns about zero."""
    averages = rng.normal(size=(TOKEN_SIZE, HISTORY, AVERAGES)) / HISTORY**0.5
    weights = {"averages": averages.astype(np.float32)}
    weights |= dense_weights(rng, "enter", TOKEN_SIZE * AVERAGES + 1, WIDTH)
    for name in _BLOCKS:
        weights |= norm_weights(f"{name}.norm", WIDTH)
        weights |= dense_weights(rng, f"{name}.dense", WIDTH, WIDTH)
    weights |= dense_weights(rng, "displacement", WIDTH, (FUTURE + 1) * _JOINTS * 3, 0.01)
    weights |= dense_weights(rng, "scale", WIDTH, (FUTURE + 1) * _JOINTS, 0.01)
    return weights | dense_weights(rng, "radius", WIDTH, (FUTURE + 1) * _JOINTS, 0.01)


def context(weights: Weights, tokens: Array, intent: Array) -> Array:
    """Returns what the network makes of tokens (N,T,c) and the intent's probability (N,).

    Returns:
        (N,`WIDTH`).
    """
    xp = namespace(tokens)
    averaged = xp.einsum("ntc,cta->nca", tokens, weights["averages"])
    entering = [averaged.reshape(tokens.shape[0], -1), 2.0 * intent[:, None] - 1.0]
    z = swish(dense(weights, "enter", xp.concatenate(entering, 1)))
    for name in _BLOCKS:
        inner = dense(weights, f"{name}.dense", normalised(weights, f"{name}.norm", z))
        z = z + swish(inner)
    return z


def residual(weights: Weights, z: Array) -> Array:
    """Returns the displacements (N,F+1,3,3), m, that are added to the linear predictor's."""
    rows = dense(weights, "displacement", z).reshape(z.shape[0], FUTURE + 1, _JOINTS, 3)
    return rows * like(_GROWTH, z)[:, None, None]


def error_scale(weights: Weights, z: Array) -> Array:
    """Returns the expected size of the error (N,F+1,3), m, of each joint and step."""
    return _size(dense(weights, "scale", z))


def radius(weights: Weights, z: Array) -> Array:
    """Returns the radius (N,F+1,3), m, of the region of each joint and step.

    A factor on the learned quantile makes it hold on sequences that nothing was trained on, too
    (conformal quantile regression, Romano, Patterson, Candès 2019).
    """
    return quantile(weights, z) * weights["region.factor"]


def linear_radius(weights: Weights) -> Array:
    """Returns the radius (F+1,3), m, of regions about the linear predictor's mean."""
    return weights["region.linear"]


def quantile(weights: Weights, z: Array) -> Array:
    """Returns what `COVERED` of the errors (N,F+1,3), m, stay within, as it was learned."""
    return 2.0 * _size(dense(weights, "radius", z))


def _size(rows: Array) -> Array:
    """Returns sizes of errors (N,F+1,3), m, of what a head returned (N,(F+1)·3)."""
    rows = rows.reshape(rows.shape[0], FUTURE + 1, _JOINTS)
    return _SMALLEST + 0.1 * softplus(rows - 1.0) * like(_GROWTH, rows)[:, None]
