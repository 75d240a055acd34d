"""Simple predictors that the learned one is compared with."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drake_dress.learning.evaluation.stream import Baseline
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.learned.filling import filled
from drake_dress.models.human.learned.forecast import PersonHistory
from drake_dress.models.human.learned.network import FUTURE, PERIOD
from drake_dress.models.human.learned.ridge import RidgePredictor
from drake_dress.models.human.prediction import ConstantVelocityPredictor, MotionPredictor

# Samples from which velocities are found, as the shipped predictor does in the same time.
_WINDOW = 5
_FOREVER = 1e6  # s


def still(history: PersonHistory) -> FloatArray:
    """Returns (F+1,6,3) the newest joints, m, at all times."""
    return np.tile(_complete(history)[-1], (FUTURE + 1, 1, 1))


def last_velocity(history: PersonHistory) -> FloatArray:
    """Returns (F+1,6,3), m: the motion between the last two samples goes on."""
    joints = _complete(history)
    return joints[-1] + np.arange(FUTURE + 1)[:, None, None] * (joints[-1] - joints[-2])


def constant_velocity(history: PersonHistory) -> FloatArray:
    """Returns (F+1,6,3), m: a robust velocity of the last samples goes on for ever."""
    return _velocity(history, _FOREVER)


def damped_velocity(history: PersonHistory) -> FloatArray:
    """Returns (F+1,6,3), m: the same velocity decays, as `constant_velocity` ships it."""
    return _velocity(history, ConstantVelocityPredictor.decay_time)


def mean_of(predictor: MotionPredictor) -> Baseline:
    """Returns a predictor of histories of `HISTORY` samples as a baseline."""
    return lambda history: predictor.predict(_complete(history), PERIOD, FUTURE)


def plain_baselines(linear: RidgePredictor) -> Mapping[str, Baseline]:
    """Returns all baselines by name."""
    return {
        "still": still,
        "last velocity": last_velocity,
        "constant velocity": constant_velocity,
        "damped velocity": damped_velocity,
        "ridge": mean_of(linear),
    }


def _velocity(history: PersonHistory, decay: float) -> FloatArray:
    predictor = ConstantVelocityPredictor(_WINDOW, PERIOD, decay_time=decay)
    return predictor.predict(_complete(history)[-_WINDOW:], PERIOD, FUTURE)


def _complete(history: PersonHistory) -> FloatArray:
    """Returns the history's joints (T,6,3) with gaps filled in, m."""
    return filled(history.joints[None])[0][0]
