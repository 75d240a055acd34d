"""Spasms: muscles of an arm that contract by themselves for a while.

The arm is drawn in the way of a flexor spasm: the elbow bends, the upper arm is drawn to the body
and turns inward. Spasms come at random times, at least half of `interval` apart, and differ in
strength. Each rises and falls smoothly (a raised cosine).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.sides import Side

# Torques relative to the elbow's: abduction, extension, rotation, elbow.
_DRAWN = np.array([-0.5, 0.0, -0.5, 1.0])
_RISE, _FALL = 0.25, 0.6  # s
_WEAKEST, _STRONGEST = 0.6, 1.4  # strength of a spasm, relative
_LONGEST = 3600.0  # time for which spasms are drawn, s
_ROUNDING = 1e-9  # s, of sums of durations


@dataclass(frozen=True)
class SpasmParameters:
    """Parameters of an arm's spasms.

    Attributes:
        sides: arms that have them, independently.
        torque: mean torque that bends the elbow, N·m.
        interval: mean time from the start of a spasm to that of the next one, s.
        duration: time for which a spasm has its full strength, s.

    Raises:
        UserError: a value is not a finite number, the torque or the duration is negative, or the
            interval is not longer than twice the whole spasm.
    """

    sides: tuple[Side, ...] = ("right",)
    torque: float = 3.0
    interval: float = 12.0
    duration: float = 1.5

    def __post_init__(self) -> None:
        for name in ("torque", "duration"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise UserError("person.spasm", name, f"is {value}, expected 0 or more")
        least = 2.0 * (_RISE + self.duration + _FALL)
        if not (math.isfinite(self.interval) and self.interval >= least - _ROUNDING):
            raise UserError(
                "person.spasm",
                "interval",
                f"is {self.interval} s, expected {least:g} or more, twice a whole spasm",
            )


class Spasms:
    """Strength of one arm's spasms over time, with mean strength 1.

    Args:
        p: times.
        rng: draws starts and strengths.
    """

    def __init__(self, p: SpasmParameters, rng: np.random.Generator) -> None:
        count = int(2.0 * _LONGEST / p.interval) + 1
        self._duration = p.duration
        self._starts = np.cumsum(0.5 * p.interval * (1.0 + rng.exponential(size=count)))
        self._strengths = rng.uniform(_WEAKEST, _STRONGEST, count)

    def value(self, time: float) -> float:
        """Returns the strength at `time`, s; 0 between spasms."""
        k = int(np.searchsorted(self._starts, time, side="right")) - 1
        if k < 0:
            return 0.0
        since = time - float(self._starts[k])
        rising, falling = since / _RISE, (since - _RISE - self._duration) / _FALL
        return float(self._strengths[k]) * _eased(rising) * (1.0 - _eased(falling))


def spasm_torque(p: SpasmParameters, side: Side) -> FloatArray:
    """Returns the mean torque (4,) of one arm's spasms, N·m; zero for an arm without."""
    torque: FloatArray = p.torque * _DRAWN * (side in p.sides)
    return torque


def _eased(share: float) -> float:
    """Returns a smooth step from 0 at a share of 0 to 1 at 1."""
    return 0.5 - 0.5 * math.cos(math.pi * min(1.0, max(0.0, share)))
