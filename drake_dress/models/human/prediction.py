"""What the arms will do next, from what they did: the interface, and predictors that learn nothing.

A predictor sees joints, never what the person wants.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.register import is_name

# Rows of the joints, parents first: each hangs on the one before it by a limb of fixed length.
_LIMBS = ((0, 1), (1, 2), (3, 4), (4, 5))
_SHOULDERS = (0, 3)


class MotionPredictor(Protocol):
    """Predicts joints from their history.

    Attributes:
        history_length: T, how many samples it wants to see, the newest included.
        sample_period: between them, s.
    """

    @property
    def history_length(self) -> int: ...  # noqa: D102

    @property
    def sample_period(self) -> float: ...  # noqa: D102

    def predict(self, history: FloatArray, time_step: float, steps: int) -> FloatArray:
        """Returns (steps+1,6,3) joints, m, row j at j·time_step from now; row 0 is now.

        Args:
            history: (T,6,3) shoulder, elbow, hand of left, then right arm, m, oldest first, the
                last row now; a joint that was not seen is NaN there. One that was never seen is
                NaN in what is returned.
            time_step: between the rows that are returned, s.
            steps: how many.
        """
        ...


@dataclass(frozen=True)
class StillPredictor:
    """The arms stay where they were seen last: a dummy has no will."""

    history_length: int = 1
    sample_period: float = 0.05

    def predict(self, history: FloatArray, time_step: float, steps: int) -> FloatArray:
        """Returns the same joints at every step; see `MotionPredictor`."""
        return np.tile(last_seen(history), (steps + 1, 1, 1))


@dataclass(frozen=True)
class ConstantVelocityPredictor:
    """The arms go on as they went, ever slower, and keep their lengths.

    A joint's velocity is the median of the slopes between all pairs of samples in the window (Theil
    1950, Sen 1968): exact where it is constant, and not moved by a few samples that are wrong. It
    is capped and dies away with the horizon, as a movement of will does end: a joint goes on by
    v τ (1 − exp(−t/τ)), never further than v τ, so that a wave does not throw the prediction away.
    Then each limb is given the length it has now, from the shoulders' middle outward.

    Attributes:
        history_length: T; the window is (T − 1)·sample_period.
        sample_period: s.
        max_speed: of a joint, m/s.
        decay_time: τ, s; infinite: the velocity does not die away.
        least_samples: with fewer of a joint seen, it is taken to stand still.
    """

    history_length: int = 9
    sample_period: float = 0.05
    max_speed: float = 1.0
    decay_time: float = 0.5
    least_samples: int = 3

    def predict(self, history: FloatArray, time_step: float, steps: int) -> FloatArray:
        """Returns joints on their way; see `MotionPredictor`."""
        now = last_seen(history)
        velocity = self._velocity(history)
        ahead = time_step * np.arange(steps + 1)
        if np.isfinite(self.decay_time):
            ahead = -self.decay_time * np.expm1(-ahead / self.decay_time)
        moved = now + ahead[:, None, None] * velocity
        return np.stack([now, *(with_lengths(q, now) for q in moved[1:])])

    def _velocity(self, history: FloatArray) -> FloatArray:
        """Returns (6,3), m/s; zero for a joint that was not seen often enough."""
        first, second = np.triu_indices(len(history), 1)
        slopes = (history[second] - history[first]) / (
            self.sample_period * (second - first)[:, None, None]
        )
        seen = np.isfinite(history).all(axis=2).sum(axis=0)
        velocity = np.where((seen >= self.least_samples)[:, None], _median_of_known(slopes), 0.0)
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        return velocity * np.minimum(1.0, self.max_speed / np.maximum(speed, 1e-12))


def _median_of_known(rows: FloatArray) -> FloatArray:
    """Returns the median over rows of what is no NaN, and NaN where there is nothing.

    For a few rows numpy's own takes five times as long.
    """
    ascending = np.sort(rows, axis=0)  # NaN goes last
    known = np.isfinite(ascending).sum(axis=0)[None]
    low, high = (np.take_along_axis(ascending, k, 0)[0] for k in ((known - 1) // 2, known // 2))
    median: FloatArray = 0.5 * (low + high)
    return np.where(known[0] > 0, median, np.nan)


def last_seen(history: FloatArray) -> FloatArray:
    """Returns (6,3) the newest sample of each joint that was seen; NaN for one that never was."""
    now = history[-1].copy()
    for earlier in history[-2::-1]:
        missing = ~np.isfinite(now).all(axis=1)
        if not missing.any():
            break
        now[missing] = earlier[missing]
    return now


def with_lengths(joints: FloatArray, like: FloatArray) -> FloatArray:
    """Returns (6,3) joints moved so that shoulder line and limbs are as long as those of `like`.

    The shoulders' middle stays, and each limb keeps its direction. A limb of which an end is NaN
    has no length; its other end is left where it is.
    """
    result = joints.copy()
    known = [bool(np.all(np.isfinite(q))) for q in joints]
    left, right = _SHOULDERS
    if known[left] and known[right]:
        middle = 0.5 * (joints[left] + joints[right])
        half = 0.5 * _resized(joints[left] - joints[right], like[left] - like[right])
        result[left], result[right] = middle + half, middle - half
    for parent, child in _LIMBS:
        if not (known[parent] and known[child]):
            continue
        limb = _resized(joints[child] - result[parent], like[child] - like[parent])
        result[child] = result[parent] + limb
    return result


def _resized(vector: FloatArray, like: FloatArray) -> FloatArray:
    """Returns `vector` with the length of `like`; `like` itself where it has no direction."""
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
        age: of the last of `samples`, in periods, in [0, 1]. Between samples lines are drawn; at
            0 and 1 the samples are taken as they are.
    """
    older, newer = samples[:-1], samples[1:]
    if age >= 1.0 - 1e-9:
        past = newer
    elif age <= 1e-9:
        past = older
    else:
        past = age * newer + (1.0 - age) * older
    return np.concatenate([past, newest[None]])


_predictors: dict[str, Callable[[], MotionPredictor]] = {
    "still": StillPredictor,
    "constant_velocity": ConstantVelocityPredictor,
}
PREDICTORS: Mapping[str, Callable[[], MotionPredictor]] = MappingProxyType(_predictors)
"""What `controller.predictor` may name; a live view, which grows with `register_predictor`."""


def register_predictor(name: str, make: Callable[[], MotionPredictor]) -> None:
    """Makes a predictor known, so that `controller.predictor` may name it.

    Args:
        name: lower-case letters, digits and _.
        make: returns a new one, such as its class.

    Raises:
        ValueError: the name is one of the package's, or no name.
    """
    if not is_name(name):
        raise ValueError(f"the name is {name!r}, expected lower-case letters, digits and _")
    if _predictors.get(name) in (StillPredictor, ConstantVelocityPredictor):
        raise ValueError(f"the name {name} is one of the package's, expected another")
    _predictors[name] = make
