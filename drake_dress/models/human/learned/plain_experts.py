"""Predictions without learning, which a person may follow better than what was learned."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.learned.network import FUTURE, PERIOD
from drake_dress.models.human.prediction import ConstantVelocityPredictor, decayed

NAMES = ("still", "damped", "constant", "returning")
_MOVING = ConstantVelocityPredictor(history_length=5, sample_period=PERIOD)
# Time constant with which a hand returns to its mean place of the last two seconds, s. Hands that
# play, wave or box are off by 1.4 times more if they are taken to stay where they are.
_RETURNS = 0.3
_SHOULDER_OF = [0, 0, 0, 3, 3, 3]


def plain_experts(joints: FloatArray) -> FloatArray:
    """Returns the predictions (4,F+1,6,3), m, of joints (T,6,3), m, by `NAMES`.

    The joints stay; go on at a velocity that decays, or that does not; or return to their mean
    place about the shoulder, which stays.

    Args:
        joints: complete, `PERIOD` apart, the last row now.
    """
    now = joints[-1]
    ahead = PERIOD * np.arange(FUTURE + 1, dtype=np.float64)
    velocity = _MOVING.velocity(joints[-_MOVING.history_length :])
    slower = decayed(ahead, _MOVING.decay_time)
    mean = (joints - joints[:, _SHOULDER_OF]).mean(axis=0) + now[_SHOULDER_OF]
    back = -np.expm1(-ahead / _RETURNS)
    moved = np.stack(
        [
            np.zeros((FUTURE + 1, 6, 3)),
            slower[:, None, None] * velocity,
            ahead[:, None, None] * velocity,
            back[:, None, None] * (mean - now),
        ]
    )
    return now + moved
