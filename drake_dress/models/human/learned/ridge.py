"""The predictor `ridge`: the shipped linear map alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.human.learned.filling import filled
from drake_dress.models.human.learned.linear import LinearMotion
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD
from drake_dress.models.human.prediction import with_lengths


@dataclass(frozen=True)
class RidgePredictor:
    """Predicts both arms by a linear map from their history.

    Attributes:
        linear: the map.
        history_length: number of samples it takes.
        sample_period: time between samples, s.
    """

    linear: LinearMotion
    history_length: int = HISTORY
    sample_period: float = PERIOD

    def predict(self, history: FloatArray, time_step: float, steps: int) -> FloatArray:
        """Returns predicted joints; see `MotionPredictor`. After two seconds they stay."""
        joints, seen = filled(history[None])
        arms = np.stack([joints[0, :, :3], joints[0, :, 3:]])
        moved = self.linear.displacement(arms)
        rows = joints[0, -1] + np.concatenate([moved[0], moved[1]], axis=1)
        return at_steps(rows, seen[0].any(axis=0), time_step, steps)


def at_steps(rows: FloatArray, seen: BoolArray, time_step: float, steps: int) -> FloatArray:
    """Returns predicted joints (steps+1,6,3), m, `time_step` apart, with the lengths of row 0.

    Args:
        rows: (F+1,6,3) m, `PERIOD` apart; beyond the last one joints stay.
        seen: (6,) whether each joint was ever observed; else it is NaN.
        time_step: s.
        steps: number of time steps.
    """
    at = np.minimum(time_step * np.arange(steps + 1) / PERIOD, FUTURE)
    low = np.minimum(at.astype(np.int64), FUTURE - 1)
    share = (at - low)[:, None, None]
    result = (1.0 - share) * rows[low] + share * rows[low + 1]
    result[:, ~seen] = np.nan
    return np.stack([result[0], *(with_lengths(q, result[0]) for q in result[1:])])
