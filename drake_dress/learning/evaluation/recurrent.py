"""A small recurrent network that predicts motion: a baseline, which the package does not ship.

A gated recurrent unit (Cho et al. 2014) reads the tokens of the history one after the other; a
dense layer returns the displacements of all steps at once.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.human.learned.layers import (
    Array,
    Weights,
    dense,
    dense_weights,
    logistic,
    namespace,
)
from drake_dress.models.human.learned.network import FUTURE
from drake_dress.models.human.learned.tokens import TOKEN_SIZE

_WIDTH = 96


def recurrent_weights(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Returns drawn weights."""
    weights: dict[str, np.ndarray] = {}
    for gate in ("update", "reset", "new"):
        weights |= dense_weights(rng, f"{gate}.token", TOKEN_SIZE, _WIDTH)
        weights |= dense_weights(rng, f"{gate}.state", _WIDTH, _WIDTH)
    return weights | dense_weights(rng, "displacement", _WIDTH, (FUTURE + 1) * 9, 0.01)


def recurrent_motion(weights: Weights, tokens: Array) -> Array:
    """Returns the displacements (N,F+1,3,3), m, of arms with tokens (N,T,c)."""
    xp = namespace(tokens)
    state = xp.zeros_like(tokens[:, 0, :1]) + xp.zeros_like(weights["new.state.bias"])
    for step in range(tokens.shape[1]):
        token = tokens[:, step]

        def gate(name: str, token: Array = token, state: Array = state) -> Array:
            from_token = dense(weights, f"{name}.token", token)
            return from_token + dense(weights, f"{name}.state", state)

        update, reset = logistic(gate("update")), logistic(gate("reset"))
        of_state = dense(weights, "new.state", state)
        new = xp.tanh(dense(weights, "new.token", token) + reset * of_state)
        state = (1.0 - update) * new + update * state
    return dense(weights, "displacement", state).reshape(tokens.shape[0], FUTURE + 1, 3, 3)
