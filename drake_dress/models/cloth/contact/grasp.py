"""What a gripper holds against the person: it gives way, and presses.

Nodes in a gripper go where the gripper goes, and a person may come to where that is. Neither
passes through the other: the robot's arm is compliant. What is held is displaced as a whole by as
little as brings it out of the bodies, and the displacement u presses with k u on gripper and
person, k the stiffness of arm and grasp. Both weigh little beside what a person pushes with, so
that u follows at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles

# A patch between two bodies is brought out of one after the other, at most this often.
_MOST = 16
# Depth that is let be, m.
_DEPTH = 1e-6


@dataclass(frozen=True)
class Pressing:
    """How the person presses on what two grippers hold.

    Attributes:
        displacement: (2,3) of it, left and right, m.
        force: (k,3) on each held node, N.
        owner: (k,) of the body that presses on it; −1 without.
    """

    displacement: FloatArray
    force: FloatArray
    owner: IntArray


def press(x: FloatArray, side: IntArray, bodies: Obstacles, stiffness: float) -> Pressing:
    """Returns how what is held gives way.

    Args:
        x: (k,3) where held nodes are taken, m.
        side: (k,) 0 or 1, the gripper that takes them.
        bodies: of the person, then.
        stiffness: of a gripper's arm and grasp, N/m.
    """
    pressing = Pressing(np.zeros((2, 3)), np.zeros_like(x), np.full(len(x), -1, dtype=np.int32))
    if not len(x) or not bodies.count:
        return pressing
    inside = find_proximity(x, bodies, 0.0).gap < -_DEPTH
    for i in (0, 1):
        if not inside[side == i].any():
            continue
        rows, moved = np.flatnonzero(side == i), pressing.displacement[i]
        for _ in range(_MOST):
            near = find_proximity(x[rows] + moved, bodies, 0.0)
            deepest = int(np.argmin(near.gap))
            if near.gap[deepest] >= -_DEPTH:
                break
            out = -near.gap[deepest] * near.normal[deepest]
            moved += out
            pressing.force[rows[deepest]] += stiffness * out
            pressing.owner[rows[deepest]] = near.owner[deepest]
    return pressing
