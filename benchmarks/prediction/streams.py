"""What is told of motions that were followed from beginning to end."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from drake_dress.learning.evaluation.held_out import area_under_curve
from drake_dress.learning.evaluation.stream import Compared
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.learned.network import PERIOD

_ARMS = (slice(0, 3), slice(3, 6))
# Probability above which an arm is taken to move by will.
_WILLED = 0.5


@dataclass
class Told:
    """Sums over comparisons of arms whose joints are all known.

    Attributes:
        moving, resting: mean errors over joints and steps, m, by predictor, of arms that move or
            rest.
        first: errors over the first second, likewise, of all arms.
        best: least errors of a sample, m.
        covered: shares of joints and steps in the regions.
        intent: (probability, truth) of arms of which it is known.
        linear: number of comparisons in which the network was not used.
        count: number of comparisons.
    """

    moving: dict[str, list[float]] = field(default_factory=dict)
    resting: dict[str, list[float]] = field(default_factory=dict)
    first: dict[str, list[float]] = field(default_factory=dict)
    best: list[float] = field(default_factory=list)
    covered: list[float] = field(default_factory=list)
    intent: list[tuple[float, float]] = field(default_factory=list)
    linear: int = 0
    count: int = 0

    def add(self, compared: Iterable[Compared]) -> None:
        """Adds the comparisons of a motion."""
        for c in compared:
            self.count += 1
            self.linear += int(c.is_linear)
            for arm, rows in enumerate(_ARMS):
                if not c.known[:, rows].all():
                    continue
                part = self.moving if c.moves[arm] else self.resting
                for name, errors in c.errors.items():
                    part.setdefault(name, []).append(float(errors[1:, rows].mean()))
                    self.first.setdefault(name, []).append(float(errors[1:11, rows].mean()))
                self.best.append(float(c.best[arm]))
                self.covered.append(float(c.inside[1:, rows].mean()))
                if np.isfinite(c.intent[1][arm]):
                    self.intent.append((float(c.intent[0][arm]), float(c.intent[1][arm])))

    def mean(self, name: str, which: str = "all") -> float:
        """Returns the mean error of a predictor over two seconds, m; NaN without any.

        Args:
            name: of the predictor.
            which: `moving`, `resting` or `all`.
        """
        rows = []
        if which in ("moving", "all"):
            rows += self.moving.get(name, [])
        if which in ("resting", "all"):
            rows += self.resting.get(name, [])
        return float(np.mean(rows)) if rows else float("nan")

    @property
    def area(self) -> float:
        """Area under the curve of the intent."""
        if not self.intent:
            return float("nan")
        told = np.array(self.intent)
        return area_under_curve(told[:, 0], told[:, 1] > 0.5)


def switch_delays(
    times: FloatArray, probability: FloatArray, truth: IndexArray, steady: float = 0.5
) -> FloatArray:
    """Returns the time, s, after which each switch from passive to active is seen.

    A switch counts if the arm was passive for `steady` s before and is active for as long after. It
    is infinite if the probability does not exceed one half before the arm is passive again.

    Args:
        times: (N,) of forecasts, s, `PERIOD` apart.
        probability: (N,) that the arm moves by will.
        truth: (N,) 1 where it does, else 0.
        steady: s.
    """
    steps = round(steady / PERIOD)
    found = []
    for k in range(steps, len(times) - steps):
        before, after = truth[k - steps : k], truth[k : k + steps]
        if before.any() or not after.all():
            continue
        end = k + int(np.argmin(np.append(truth[k:], 0)))
        seen = np.flatnonzero(probability[k:end] > _WILLED)
        found.append(float(times[k + seen[0]] - times[k]) if len(seen) else np.inf)
    return np.array(found)


def delays_of(compared: Sequence[Compared]) -> FloatArray:
    """Returns the delays, s, of all switches of both arms of a motion."""
    times = np.array([c.time for c in compared])
    found = []
    for arm in (0, 1):
        truth = np.array([c.intent[1][arm] for c in compared])
        if len(truth) and np.all(np.isfinite(truth)):
            probability = np.array([c.intent[0][arm] for c in compared])
            found.append(switch_delays(times, probability, truth.astype(np.int64)))
    return np.concatenate(found) if found else np.zeros(0)
