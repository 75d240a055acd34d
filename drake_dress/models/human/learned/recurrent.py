"""The predictor `recurrent`: a small recurrent network alone, as a baseline.

A gated recurrent unit (Cho et al. 2014) reads the tokens of the history one after the other; a
dense layer returns the displacements of all steps at once. As a predictor it sees joints alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drake_dress.machine import one_thread
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.learned.filling import filled
from drake_dress.models.human.learned.layers import (
    Array,
    Weights,
    dense,
    dense_weights,
    logistic,
    namespace,
)
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD
from drake_dress.models.human.learned.ridge import at_steps
from drake_dress.models.human.learned.tokens import TOKEN_SIZE, Windows, arm_tokens

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


@dataclass(frozen=True)
class RecurrentPredictor:
    """Predicts both arms from their history by the recurrent network.

    Attributes:
        weights: of the network.
        history_length: number of samples it takes.
        sample_period: time between samples, s.
    """

    weights: Mapping[str, np.ndarray]
    history_length: int = HISTORY
    sample_period: float = PERIOD

    def predict(self, history: FloatArray, time_step: float, steps: int) -> FloatArray:
        """Returns predicted joints; see `MotionPredictor`. After two seconds they stay."""
        joints, seen = filled(history[None])
        sleeves = np.zeros((1, len(history), 2, 6))
        unseen = np.zeros((1, len(history), 2), dtype=bool)
        arms = arm_tokens(Windows(joints, seen, sleeves, unseen, PERIOD))
        with one_thread():
            moved = recurrent_motion(self.weights, arms.tokens)
        world = arms.frames.world(arms.joints[:, -1:, :3] + moved)
        rows = np.concatenate([world[0], world[1]], axis=1)
        return at_steps(rows, seen[0].any(axis=0), time_step, steps)
