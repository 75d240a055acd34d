"""Whether an arm moves by will or only with the garment: a small attention network.

It looks at all steps of the history that there are, so that it can compare how arm and sleeve
moved, and answers for the newest one: a switch shows as soon as it is in the motion.

It is asked twice: with the sleeves and without them. How a garment moves with an arm differs more
between a simulation and the world than how people move, so the arm's own motion has half of the
say.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drake_dress.models.human.learned.layers import (
    Array,
    Weights,
    block,
    block_weights,
    dense,
    dense_weights,
    norm_weights,
    normalised,
)
from drake_dress.models.human.learned.network import HISTORY
from drake_dress.models.human.learned.tokens import SLEEVE_COLUMNS, TOKEN_SIZE

_WIDTH, _HEADS = 32, 4
_BLOCKS = ("first", "second")


def intent_weights(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Returns drawn weights."""
    weights = dense_weights(rng, "enter", TOKEN_SIZE, _WIDTH)
    weights["place"] = (0.1 * rng.normal(size=(HISTORY, _WIDTH))).astype(np.float32)
    for name in _BLOCKS:
        weights |= block_weights(rng, name, _WIDTH)
    weights |= norm_weights("last", _WIDTH)
    return weights | dense_weights(rng, "intent", _WIDTH, 1, 0.1)


def intent_logit(weights: Weights, tokens: Array, hidden: Array) -> Array:
    """Returns the logarithm of the odds (N,) that each arm moves by will now.

    Args:
        weights: of the network.
        tokens: (N,T,c).
        hidden: (N,T) 1 for steps that are not in the history, else 0.
    """
    z = dense(weights, "enter", tokens) + weights["place"]
    for name in _BLOCKS:
        z = block(weights, name, z, _HEADS, hidden, newest=name == _BLOCKS[-1])
    return dense(weights, "intent", normalised(weights, "last", z[:, -1]))[:, 0]


def balanced_logit(
    weights: Mapping[str, np.ndarray], tokens: np.ndarray, hidden: np.ndarray
) -> np.ndarray:
    """Returns the mean of the logits (N,) with sleeves and without; see `intent_logit`."""
    bare = tokens.copy()
    bare[:, :, SLEEVE_COLUMNS] = 0.0
    with_sleeves, without = np.split(
        intent_logit(weights, np.concatenate([tokens, bare]), np.concatenate([hidden, hidden])), 2
    )
    mean: np.ndarray = 0.5 * (with_sleeves + without)
    return mean
