"""What a robot leads a sleeve to: over a hand, up an arm, aside, across, about, or nowhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.dressing.coordinates import ArmAxis

GoalKind = Literal["approach", "roam", "draw", "aside", "across", "stay"]
# Shares of goals: of a sleeve off its arm, of one on it, and of one on it while the other hand
# waits for its sleeve. Many of these lead arms aside, or the coat across to the other hand.
_OFF_ARM: dict[GoalKind, float] = {"approach": 0.45, "roam": 0.45, "stay": 0.1}
_ON_ARM: dict[GoalKind, float] = {"draw": 0.35, "aside": 0.55, "stay": 0.1}
_ONE_ON: dict[GoalKind, float] = {"draw": 0.2, "aside": 0.25, "across": 0.45, "stay": 0.1}
_LASTS = 1.0, 5.0  # s, of a goal
# An approach: the sleeve first goes to this distance before the hand, in line with the forearm, and
# over the hand once it is as near to that line, m.
_BEFORE, _IN_LINE = 0.10, 0.06
# Cloth hinders it, and it misses the hand by this standard deviation of each coordinate, m.
_MISSES = 0.045
_ACROSS = 0.1, 0.6  # share of the way to the other hand
# Aside: distance, m. Roaming about a place above the hand, m: standard deviation. Both are farther
# sideways than up and down.
_ASIDE, _ASIDE_FLATTENED = (0.08, 0.45), np.array([1.0, 1.0, 0.6])
_ROAMS, _ROAMS_FLATTENED = 0.35, np.array([1.0, 1.0, 0.7])
_ROAMS_ABOVE = np.array([0.0, 0.0, 0.1])


@dataclass(frozen=True)
class Goal:
    """What a sleeve is led to.

    Attributes:
        kind: of the goal.
        place: (3,) of a sleeve that is led aside or across, or roams; by how much an approach
            misses the hand; m.
        until: time until which it holds, s.
    """

    kind: GoalKind
    place: FloatArray
    until: float


def draw_goal(
    rng: np.random.Generator,
    axis: ArmAxis,
    center: FloatArray,
    on: bool,
    time: float,
    other: FloatArray | None = None,
) -> Goal:
    """Returns a goal from now on.

    Args:
        rng: draws.
        axis: of the sleeve's arm.
        center: (3,) of the armhole, m.
        on: whether the arm is in its sleeve.
        time: s.
        other: (3,) the other hand if that waits for its sleeve, m.
    """
    shares = _OFF_ARM if not on else _ON_ARM if other is None else _ONE_ON
    kinds = list(shares)
    kind = kinds[rng.choice(len(kinds), p=list(shares.values()))]
    until = time + rng.uniform(*_LASTS)
    place = center.copy()
    if kind == "approach":
        place = _MISSES * rng.normal(size=3)
    elif kind == "aside":
        way = rng.normal(size=3) * _ASIDE_FLATTENED
        place = place + rng.uniform(*_ASIDE) * unit(way)
    elif kind == "across" and other is not None:
        place = place + rng.uniform(*_ACROSS) * (other - place)
    elif kind == "roam":
        about = axis.G(0.0) + _ROAMS_ABOVE
        place = about + _ROAMS * rng.normal(size=3) * _ROAMS_FLATTENED
    return Goal(kind, place, until)


def place_of(goal: Goal, axis: ArmAxis, center: FloatArray, progress: float | None) -> FloatArray:
    """Returns the place (3,), m, that a goal other than `draw` leads a sleeve to now.

    Args:
        goal: of the sleeve.
        axis: of its arm.
        center: (3,) of the armhole, m.
        progress: s of the sleeve on its arm; None where it is not on.
    """
    if goal.kind == "stay":
        return center if progress is None else axis.G(progress)
    if goal.kind == "approach":
        hand, way = axis.G(0.0), axis.D(0.0)
        aside = center - hand
        aside = aside - (aside @ way) * way
        straight = hand if np.linalg.norm(aside) < _IN_LINE else hand - _BEFORE * way
        missed: FloatArray = straight + goal.place
        return missed
    return goal.place


def unit(vector: FloatArray) -> FloatArray:
    """Returns a vector (3,) scaled to length 1."""
    scaled: FloatArray = vector / max(float(np.linalg.norm(vector)), 1e-9)
    return scaled
