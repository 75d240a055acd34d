"""What a predictor of persons takes and returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.human.history import Sampling
from drake_dress.models.immutable import Immutable


@dataclass(frozen=True)
class PersonHistory:
    """T samples of a person and both sleeves, one period apart, the last one now.

    Attributes:
        time: of the last sample, s.
        joints: (T,6,3) shoulder, elbow, hand of left, then right arm, m, NaN where not observed.
        sleeves: (T,2,6) centre, m, and unit direction from cuff to armhole of left and right
            armhole, NaN where not known.
    """

    time: float
    joints: FloatArray
    sleeves: FloatArray

    @classmethod
    def of_points(cls, time: float, rows: FloatArray) -> PersonHistory:
        """Returns the history of points (T,10,3), m: joints, then each sleeve's two rows."""
        return cls(time, rows[:, :6], rows[:, 6:].reshape(-1, 2, 6))


@dataclass(frozen=True)
class Forecast(Immutable):
    """The predicted motion of both arms, F steps from now on.

    Attributes:
        start: time of row 0, s.
        step: time between rows, s.
        mean: (F+1,6,3) joints, m; row 0 is now, with hidden joints filled in.
        radius: (F+1,6) of the balls about `mean` that hold the joints with probability 0.9, m.
        samples: (S,F+1,6,3) possible motions, m.
        intent: (2,) probability that left and right arm move by will.
        is_linear: whether a linear predictor was used in place of the network, because the input is
            unlike what the network was trained on.
        seen: (6,) whether each joint is observed now.
    """

    start: float
    step: float
    mean: FloatArray
    radius: FloatArray
    samples: FloatArray
    intent: FloatArray
    is_linear: bool
    seen: BoolArray

    def mean_at(self, times: FloatArray) -> FloatArray:
        """Returns the joints (K,6,3), m, at times (K,), s; constant beyond the last row."""
        return self._at(self.mean, times)

    def radius_at(self, times: FloatArray) -> FloatArray:
        """Returns the radii (K,6), m, at times (K,), s."""
        return self._at(self.radius, times)

    def samples_at(self, times: FloatArray) -> FloatArray:
        """Returns the samples (S,K,6,3), m, at times (K,), s."""
        rows = self._at(np.swapaxes(self.samples, 0, 1), times)
        return np.swapaxes(rows, 0, 1)

    def _at(self, rows: FloatArray, times: FloatArray) -> FloatArray:
        last = len(rows) - 1
        at = np.clip((times - self.start) / self.step, 0.0, last)
        low = np.minimum(at.astype(np.int64), max(last - 1, 0))
        share = (at - low).reshape(-1, *[1] * (rows.ndim - 1))
        between: FloatArray = (1.0 - share) * rows[low] + share * rows[np.minimum(low + 1, last)]
        return between


@runtime_checkable
class PersonPredictor(Protocol):
    """Predicts a person from a history, and remembers how well it did.

    Attributes:
        sampling: of the history that it takes.
    """

    @property
    def sampling(self) -> Sampling: ...  # noqa: D102

    def begin(self) -> Any:
        """Returns the memory before the first forecast."""
        ...

    def forecast(self, history: PersonHistory, memory: Any) -> tuple[Forecast, Any]:
        """Returns the forecast from the last sample on, and the memory for the next one."""
        ...
