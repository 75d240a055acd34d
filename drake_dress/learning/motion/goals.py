"""What a robot leads a sleeve to: over a hand, up an arm, aside, about, or nowhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.dressing.coordinates import ArmAxis

GoalKind = Literal["approach", "roam", "draw", "aside", "stay"]
# Shares of goals: of a sleeve off its arm, and of one on it. Half of the latter lead arms aside, as
# a coat does that is brought to the other hand.
_OFF_ARM: dict[GoalKind, float] = {"approach": 0.6, "roam": 0.2, "stay": 0.2}
_ON_ARM: dict[GoalKind, float] = {"draw": 0.35, "aside": 0.55, "stay": 0.1}
_LASTS = 2.0, 6.0  # s, of a goal
# An approach: the sleeve first goes to this distance before the hand, in line with the forearm, and
# over the hand once it is as near to that line, m.
_BEFORE, _IN_LINE = 0.10, 0.06
# Aside: distance, m. Roaming about the hand: standard deviation, m. Both are flatter than high.
_ASIDE, _ASIDE_FLATTENED = (0.08, 0.45), np.array([1.0, 1.0, 0.6])
_ROAMS, _ROAMS_FLATTENED = 0.35, np.array([1.0, 1.0, 0.5])


@dataclass(frozen=True)
class Goal:
    """What a sleeve is led to.

    Attributes:
        kind: of the goal.
        place: (3,) of a sleeve that is led aside or roams, m.
        until: time until which it holds, s.
    """

    kind: GoalKind
    place: FloatArray
    until: float


def draw_goal(
    rng: np.random.Generator, axis: ArmAxis, center: FloatArray, on: bool, time: float
) -> Goal:
    """Returns a goal from now on.

    Args:
        rng: draws.
        axis: of the sleeve's arm.
        center: (3,) of the armhole, m.
        on: whether the arm is in its sleeve.
        time: s.
    """
    shares = _ON_ARM if on else _OFF_ARM
    kinds = list(shares)
    kind = kinds[rng.choice(len(kinds), p=list(shares.values()))]
    until = time + rng.uniform(*_LASTS)
    place = center.copy()
    if kind == "aside":
        way = rng.normal(size=3) * _ASIDE_FLATTENED
        place = place + rng.uniform(*_ASIDE) * unit(way)
    elif kind == "roam":
        place = axis.G(0.0) + _ROAMS * rng.normal(size=3) * _ROAMS_FLATTENED
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
        return hand if np.linalg.norm(aside) < _IN_LINE else hand - _BEFORE * way
    return goal.place


def unit(vector: FloatArray) -> FloatArray:
    """Returns a vector (3,) scaled to length 1."""
    scaled: FloatArray = vector / max(float(np.linalg.norm(vector)), 1e-9)
    return scaled
