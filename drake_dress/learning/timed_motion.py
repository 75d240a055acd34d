"""Motion of a person over time, from any source."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.history import Observations, Sampling
from drake_dress.models.human.learned.forecast import PersonHistory


@dataclass(frozen=True)
class TimedMotion:
    """A recording, a sequence or a dressing.

    Attributes:
        name: for tables.
        time: (N,) s, strictly increasing, at any rate.
        joints: (N,6,3) shoulder, elbow, hand of left, then right arm, m, NaN where not known.
        sleeves: (N,2,6) armhole centre, m, and unit direction from cuff to armhole; NaN where not
            known.
        intent: (N,2) 1 where an arm moves by will, else 0; None where nobody knows.
    """

    name: str
    time: FloatArray
    joints: FloatArray
    sleeves: FloatArray
    intent: IndexArray | None = None

    def between(self, first: float, last: float) -> TimedMotion:
        """Returns the part from `first` to `last`, s."""
        kept = (self.time >= first) & (self.time <= last)
        intent = None if self.intent is None else self.intent[kept]
        return TimedMotion(
            self.name, self.time[kept], self.joints[kept], self.sleeves[kept], intent
        )

    def history(self, now: float, sampling: Sampling, observed: FloatArray) -> PersonHistory:
        """Returns what is known at `now`, s.

        Args:
            now: s.
            sampling: of the history.
            observed: (N,6,3) joints as they are observed, m: with noise or gaps.
        """
        first, last = np.searchsorted(self.time, [now - sampling.kept, now + 1e-9])
        points = np.concatenate(
            [observed[first:last], self.sleeves[first:last].reshape(-1, 4, 3)], axis=1
        )
        rows = Observations(self.time[first:last], points).sampled(now, sampling)
        return PersonHistory.of_points(now, rows)

    def joints_at(self, times: FloatArray) -> FloatArray:
        """Returns the joints (K,6,3), m, at times (K,), s: interpolated; NaN beyond the ends."""
        result = np.full((len(times), 6, 3), np.nan)
        for k in range(6):
            known = np.all(np.isfinite(self.joints[:, k]), axis=1)
            if known.sum() < 2:
                continue
            stamps, points = self.time[known], self.joints[known, k]
            inside = (times >= stamps[0] - 1e-9) & (times <= stamps[-1] + 1e-9)
            for axis in range(3):
                result[inside, k, axis] = np.interp(times[inside], stamps, points[:, axis])
        return result

    def intent_at(self, time: float) -> IndexArray | None:
        """Returns (2,) the intent at `time`, s; None where nobody knows."""
        if self.intent is None:
            return None
        return self.intent[int(np.clip(np.searchsorted(self.time, time), 0, len(self.time) - 1))]
