"""Strokes: voluntary movements from one place to another, as people make them.

The speed of a stroke is bell-shaped: that of the beta distribution with exponents a and b, in which
a = b = 2 is the minimum-jerk profile (Flash and Hogan 1985) and a < b rises faster than it falls,
as fast movements do. Strokes that overlap in time add up: a change of mind in the middle of a
movement is a second stroke superposed on the first (Flash and Henis 1991).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import betainc

from drake_dress.models.arrays import FloatArray

# Range of the exponents of a stroke's profile: about the minimum-jerk profile and steeper ones.
_EXPONENTS = 1.6, 3.2
# Standard deviation of a path's bow, as a share of its length: hand paths are nearly straight.
_BOW = 0.06
# Duration of a stroke: s, at a length, m; it grows with this power of the length, since longer
# movements are faster (isochrony: Viviani and McCollum 1983), and spreads from one movement of a
# person to the next by this standard deviation of its logarithm. Calm movements, as in a dressing.
_TYPICAL_TIME, _TYPICAL_LENGTH, _GROWTH, _SPREAD = 1.4, 0.3, 0.4, 0.12
_FASTEST = 0.9  # m/s, largest mean speed
_SHORTEST, _LONGEST = 0.35, 4.0  # s, duration of a stroke
# Persons differ more from each other: standard deviation and mean of the logarithm of their pace.
# Who is dressed moves calmly.
PACES, CALM = 0.4, 0.25
# Share of its way before which a stroke has hardly begun, and that is left where it has nearly
# ended.
_UNSEEN = 0.02
# Share of movements made of one stroke. Others hesitate: they stop after a share of the way, for up
# to this time, s.
_WITHOUT_PAUSE, _FIRST_SHARE, _LONGEST_PAUSE = 0.75, (0.25, 0.75), 0.8


@dataclass(frozen=True)
class Stroke:
    """A movement by `way`, from `start` to `start + duration`, s.

    Attributes:
        start: s. duration: s.
        way: (k,) displacement, in any unit.
        bow: (k,) largest deviation from the straight line.
        exponents: a, b of its speed profile.
    """

    start: float
    duration: float
    way: FloatArray
    bow: FloatArray
    exponents: tuple[float, float] = (2.0, 2.0)

    @property
    def end(self) -> float:
        """Time at which it ends, s."""
        return self.start + self.duration

    def is_on(self, time: float) -> bool:
        """Returns whether the movement is in progress at `time`, s."""
        return self.start <= time < self.end

    def done(self, time: float) -> float:
        """Returns the share of its way that is done at `time`, s."""
        u = min(1.0, max(0.0, (time - self.start) / self.duration))
        return float(betainc(self.exponents[0] + 1.0, self.exponents[1] + 1.0, u))

    def is_seen(self, time: float) -> bool:
        """Returns whether it moves anything to speak of at `time`, s."""
        return _UNSEEN < self.done(time) < 1.0 - _UNSEEN

    def position(self, time: float) -> FloatArray:
        """Returns the displacement (k,) since the start, at `time`, s."""
        done = self.done(time)
        if done <= 0.0:
            return np.zeros_like(self.way)
        if done >= 1.0:
            return self.way
        placed: FloatArray = done * self.way + 4.0 * done * (1.0 - done) * self.bow
        return placed


def draw_stroke(
    rng: np.random.Generator, start: float, way: FloatArray, slower: float = 1.0
) -> Stroke:
    """Returns a stroke by `way` of drawn duration, profile and bow.

    Args:
        rng: draws.
        start: time of its start, s.
        way: (k,) displacement, m.
        slower: factor on its duration.
    """
    length = float(np.linalg.norm(way))
    time = _TYPICAL_TIME * (length / _TYPICAL_LENGTH) ** _GROWTH * np.exp(_SPREAD * rng.normal())
    duration = max(slower * time, length / _FASTEST)
    bow = _BOW * length * rng.normal(size=len(way))
    if length > 0.0:
        # across the way
        bow = bow - way * float(bow @ way) / length**2
    a, b = rng.uniform(*_EXPONENTS, 2)
    return Stroke(start, float(np.clip(duration, _SHORTEST, _LONGEST)), way, bow, (a, b))


def draw_strokes(
    rng: np.random.Generator, start: float, way: FloatArray, slower: float = 1.0
) -> list[Stroke]:
    """Returns strokes that together move by `way`: one, or two with a pause between.

    Args:
        rng: draws.
        start: time of the first start, s.
        way: (k,) displacement, m.
        slower: factor on their durations.
    """
    if rng.random() < _WITHOUT_PAUSE:
        return [draw_stroke(rng, start, way, slower)]
    share = rng.uniform(*_FIRST_SHARE)
    first = draw_stroke(rng, start, share * way, slower)
    pause = rng.uniform(0.0, _LONGEST_PAUSE)
    return [first, draw_stroke(rng, first.end + pause, (1.0 - share) * way, slower)]
