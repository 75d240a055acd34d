"""Where the sleeves of a coat are at the start of a sequence: in a drawn phase of a dressing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.learning.motion.goals import unit
from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.garment.geodesics import Reach

# Phases of a dressing, which arms are in their sleeves, and their shares.
_PHASES = np.array([[False, False], [True, False], [False, True], [True, True]])
_SHARES = 0.4, 0.2, 0.2, 0.2
_PROGRESS = 0.05, 1.9  # s of a sleeve on its arm: past the hand, before the shoulder
# A sleeve off its arm is at this distance from the hand, m, before it and higher, since the coat is
# held at its shoulders, in a direction with this standard deviation of each component.
_AWAY, _SPREAD, _HIGHER = (0.08, 0.55), 0.9, 0.5
_STRETCH = 0.95  # share of the coat's reach that sleeves, and grippers, are apart at most
# Grippers are at this share of their reach from their armholes, above, in a direction with this
# standard deviation of each component.
_HELD, _HELD_SPREAD = 0.9, 0.5
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class SleeveStart:
    """State of both sleeves and grippers at the start.

    Attributes:
        center, gripper: (2,3), m.
        on: (2,) whether each arm is in its sleeve.
        progress: (2,) s of each sleeve on its arm; 0 off it.
    """

    center: FloatArray
    gripper: FloatArray
    on: BoolArray
    progress: FloatArray


def draw_start(
    rng: np.random.Generator, reach: Reach, axes: tuple[ArmAxis, ArmAxis]
) -> SleeveStart:
    """Returns a drawn start.

    Args:
        rng: draws.
        reach: of the coat.
        axes: of left and right arm.
    """
    on = _PHASES[rng.choice(len(_PHASES), p=_SHARES)].copy()
    progress = np.where(on, rng.uniform(*_PROGRESS, 2), 0.0)
    center = np.zeros((2, 3))
    for i, axis in enumerate(axes):
        if on[i]:
            center[i] = axis.G(progress[i])
            continue
        away = unit(-axis.D(0.0) + _SPREAD * rng.normal(size=3) + _HIGHER * _UP)
        center[i] = axis.G(0.0) + rng.uniform(*_AWAY) * away
    _bring_within_reach(center, on, reach.between_sleeves)
    near = np.array(reach.to_near_gripper)[:, None]
    above = np.stack([unit(_UP + _HELD_SPREAD * rng.normal(size=3)) for _ in (0, 1)])
    gripper = center + _HELD * near * above
    _bring_within_reach(gripper, np.zeros(2, dtype=bool), reach.between_grippers)
    return SleeveStart(center, gripper, on, progress)


def _bring_within_reach(places: FloatArray, bound: BoolArray, reach: float) -> None:
    """Moves places (2,3) that the coat cannot span nearer to each other, in place.

    One that is not bound goes to the other; if both are bound or free, each goes half the way.

    Args:
        places: m.
        bound: (2,) whether each is bound to its arm.
        reach: largest distance between them in the coat, m.
    """
    gap = places[1] - places[0]
    far = float(np.linalg.norm(gap)) / (_STRETCH * reach)
    if far > 1.0:
        free = [i for i in (0, 1) if not bound[i]] or [0, 1]
        for i in free:
            sign = 1.0 if i == 0 else -1.0
            places[i] += sign * gap * (1.0 - 1.0 / far) / len(free)
