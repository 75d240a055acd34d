"""What a person's arms can do of what the second sleeve needs.

The first sleeve goes onto an arm while the coat hangs free. For the second one the coat hangs on
the first arm, behind the person, and the hand has to come to it: to within the coat's reach of the
other shoulder, behind the trunk. An arm that comes there with difficulty or not at all, because it
is stiff or paralysed, has to go first. Carers know this as "dress the weak side first".

The room of an arm is the volume of the places there that its hand gets to, over the ranges of its
joints. It leaves out that the trunk is in the way of some of these poses.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm import Arms

_STEP = np.deg2rad(20.0)  # largest step between angles of a joint
_CELL = 0.08  # edge of the cells that are counted, m; hands on the grid are nearer to each other


def room_for_second(arms: Arms, side: int, reach: float, from_front: bool = False) -> float:
    """Returns the volume, m³, of the places where a second sleeve comes and the hand can be.

    Args:
        arms: of the person, with the limits of their joints.
        side: arm that would be second, 0 for left.
        reach: distance between the garment's armholes at rest, m.
        from_front: whether the garment comes from the front, so that the hand has to come there.
    """
    other = arms.arms[1 - side]
    trunk = 0.5 * other.measures.chest_depth + other.measures.hand_radius
    hands = reachable_hands(arms, side) - other.shoulder
    outward = hands[:, 0] if from_front else -hands[:, 0]
    there = (np.linalg.norm(hands, axis=1) <= reach) & (outward >= trunk)
    cells = np.unique(np.floor(hands[there] / _CELL), axis=0)
    return float(len(cells)) * _CELL**3


def reachable_hands(arms: Arms, side: int) -> FloatArray:
    """Returns places (k,3) of a hand over the ranges of its joints, in the torso's frame, m.

    An arm without tone is where it rests.
    """
    arm = arms.arms[side]
    if not arms.has_tone[side]:
        return arm.hand(arms.rest[side])[None]
    angles = [
        np.linspace(low, high, 2 + int((high - low) / _STEP)) for low, high in arms.limits[side].T
    ]
    return np.stack([arm.hand(np.array(q)) for q in product(*angles)])


def are_alike(arms: Arms) -> bool:
    """Returns whether both arms have the same ranges and the same tone."""
    same = bool(np.array_equal(arms.limits[0], arms.limits[1]))
    return same and arms.has_tone[0] == arms.has_tone[1]
