"""Predicts the arms' motion from its history: the interface, and predictors without learning.

A predictor sees joints, never the person's intent.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.register import is_name

if TYPE_CHECKING:
    from drake_dress.models.human.learned.forecast import PersonPredictor

# Rows of the two joints of each limb, parent first; a limb has a fixed length.
LIMBS = ((0, 1), (1, 2), (3, 4), (4, 5))
_SHOULDERS = (0, 3)


class MotionPredictor(Protocol):
    """Predicts joints from their history.

    Attributes:
        history_length: T, number of samples it needs, including the newest.
        sample_period: time between samples, s.
    """

    @property
    def history_length(self) -> int: ...  # noqa: D102

    @property
    def sample_period(self) -> float: ...  # noqa: D102

    def predict(self, history: FloatArray, time_step: float, steps: int) -> FloatArray:
        """Returns (steps+1,6,3) joints, m, row j at j·time_step from now; row 0 is now.

        Args:
            history: (T,6,3) shoulder, elbow, hand of left, then right arm, m, oldest first, the
                last row now. A joint is NaN where it was not observed; if it was never observed, it
                is NaN in the result.
            time_step: time between the returned rows, s.
            steps: number of time steps.
        """
        ...


@dataclass(frozen=True)
class StillPredictor:
    """Predicts that the arms stay where they were last observed, as a dummy's do."""

    history_length: int = 1
    sample_period: float = 0.05

    def predict(self, history: FloatArray, time_step: float, steps: int) -> FloatArray:
        """Returns the same joints at every step; see `MotionPredictor`."""
        return np.tile(last_seen(history), (steps + 1, 1, 1))


@dataclass(frozen=True)
class ConstantVelocityPredictor:
    """Predicts that the arms keep their velocity, which decays, and their lengths.

    A joint's velocity is the median of the slopes between all pairs of samples in the window (Theil
    1950, Sen 1968): exact if it is constant, and robust against a few wrong samples. It is capped
    and decays over the horizon, since voluntary movements end: a joint moves by
    v τ (1 − exp(−t/τ)), never farther than v τ, so that a wave does not spoil the prediction. Then
    each limb is reset to its current length, from the shoulders' midpoint outward.

    Attributes:
        history_length: T; the window is (T − 1)·sample_period.
        sample_period: time between samples, s.
        max_speed: largest speed of a joint, m/s.
        decay_time: τ, s; if infinite, the velocity does not decay.
        least_samples: a joint with fewer observations is assumed to stand still.
    """

    history_length: int = 9
    sample_period: float = 0.05
    max_speed: float = 1.0
    decay_time: float = 0.5
    least_samples: int = 3

    def predict(self, history: FloatArray, time_step: float, steps: int) -> FloatArray:
        """Returns extrapolated joints; see `MotionPredictor`."""
        now = last_seen(history)
        velocity = self.velocity(history)
        ahead = decayed(time_step * np.arange(steps + 1, dtype=np.float64), self.decay_time)
        moved = now + ahead[:, None, None] * velocity
        return np.stack([now, *(with_lengths(q, now) for q in moved[1:])])

    def velocity(self, history: FloatArray) -> FloatArray:
        """Returns (6,3), m/s; zero for a joint that was not observed often enough.

        Args:
            history: (T,6,3) m, `sample_period` apart; a joint is NaN where it was not observed.
        """
        first, second = np.triu_indices(len(history), 1)
        slopes = (history[second] - history[first]) / (
            self.sample_period * (second - first)[:, None, None]
        )
        seen = np.isfinite(history).all(axis=2).sum(axis=0)
        velocity = np.where((seen >= self.least_samples)[:, None], median_of_known(slopes), 0.0)
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        return velocity * np.minimum(1.0, self.max_speed / np.maximum(speed, 1e-12))


def decayed(ahead: FloatArray, decay_time: float) -> FloatArray:
    """Returns the times, s, in which a constant velocity leads as far as one that decays."""
    if not np.isfinite(decay_time):
        return ahead
    shorter: FloatArray = -decay_time * np.expm1(-ahead / decay_time)
    return shorter


def median_of_known(rows: FloatArray) -> FloatArray:
    """Returns the median over rows without NaN, and NaN where all rows are NaN.

    For a few rows numpy's own function takes five times as long.
    """
    ascending = np.sort(rows, axis=0)  # NaN goes last
    known = np.isfinite(ascending).sum(axis=0)[None]
    low, high = (np.take_along_axis(ascending, k, 0)[0] for k in ((known - 1) // 2, known // 2))
    median: FloatArray = 0.5 * (low + high)
    return np.where(known[0] > 0, median, np.nan)


def last_seen(history: FloatArray) -> FloatArray:
    """Returns (6,3) the newest observation of each joint; NaN if it was never observed."""
    now = history[-1].copy()
    for earlier in history[-2::-1]:
        missing = ~np.isfinite(now).all(axis=1)
        if not missing.any():
            break
        now[missing] = earlier[missing]
    return now


def with_lengths(joints: FloatArray, like: FloatArray) -> FloatArray:
    """Returns (6,3) joints moved so that shoulder line and limbs are as long as those of `like`.

    The shoulders' midpoint stays. Each limb is directed from its moved parent to the old child. If
    one end of a limb is NaN, the other end stays.
    """
    result = joints.copy()
    known = [bool(np.all(np.isfinite(q))) for q in joints]
    left, right = _SHOULDERS
    if known[left] and known[right]:
        middle = 0.5 * (joints[left] + joints[right])
        half = 0.5 * _resized(joints[left] - joints[right], like[left] - like[right])
        result[left], result[right] = middle + half, middle - half
    for parent, child in LIMBS:
        if not (known[parent] and known[child]):
            continue
        limb = _resized(joints[child] - result[parent], like[child] - like[parent])
        result[child] = result[parent] + limb
    return result


def _resized(vector: FloatArray, like: FloatArray) -> FloatArray:
    """Returns `vector` with the length of `like`; `like` itself if `vector` is zero."""
    length = float(np.linalg.norm(vector))
    if length < 1e-9:
        return like
    resized: FloatArray = vector * (float(np.linalg.norm(like)) / length)
    return resized


def resampled(samples: FloatArray, newest: FloatArray, age: float) -> FloatArray:
    """Returns (T,…) samples whose last row is `newest`, one period apart, oldest first.

    Args:
        samples: (T,…) taken one period apart, oldest first.
        newest: (…) taken now.
        age: age of the last of `samples`, in periods, in [0, 1]. Samples are interpolated linearly;
            at 0 and 1 they are taken as they are.
    """
    older, newer = samples[:-1], samples[1:]
    if age >= 1.0 - 1e-9:
        past = newer
    elif age <= 1e-9:
        past = older
    else:
        past = age * newer + (1.0 - age) * older
    return np.concatenate([past, newest[None]])


def trained_predictor(name: str, folder: Path | None = None) -> MotionPredictor | PersonPredictor:
    """Returns a predictor that has learned.

    Args:
        name: one of `TRAINED`.
        folder: with weights of `drake-dress train`; None for those of the package.

    Raises:
        UserError: a file in the folder is missing or unusable.
    """
    # what is learned is read only where it is wanted
    from drake_dress.models.human.learned import weights

    make: dict[str, Callable[..., MotionPredictor | PersonPredictor]] = {
        "ridge": weights.ridge_predictor,
        "recurrent": weights.recurrent_predictor,
        "learned": weights.learned_predictor,
    }
    return make[name]() if folder is None else make[name](folder)


TRAINED = ("ridge", "recurrent", "learned")
_OWN: dict[str, Callable[[], MotionPredictor | PersonPredictor]] = {
    "still": StillPredictor,
    "constant_velocity": ConstantVelocityPredictor,
    **{name: partial(trained_predictor, name) for name in TRAINED},
}
_predictors = dict(_OWN)
PREDICTORS: Mapping[str, Callable[[], MotionPredictor | PersonPredictor]] = MappingProxyType(
    _predictors
)
"""What `controller.predictor` may name; a live view, which grows with `register_predictor`."""


def register_predictor(name: str, make: Callable[[], MotionPredictor | PersonPredictor]) -> None:
    """Registers a predictor, so that `controller.predictor` may name it.

    Args:
        name: lower-case letters, digits and _.
        make: returns a new predictor; its class will do.

    Raises:
        ValueError: the name is one of the package's, or is not a valid name.
    """
    if not is_name(name):
        raise ValueError(f"the name is {name!r}, expected lower-case letters, digits and _")
    if name in _OWN:
        raise ValueError(f"the name {name} is one of the package's, expected another")
    _predictors[name] = make
