"""Compliance of a gripper whose cloth is pressed against the person.

Nodes in a gripper move with it, and may move into the person. Neither passes through the other,
because the robot's arm is compliant. The held cloth is displaced as a whole by the least amount
that brings it out of the bodies. The displacement u causes a force k u on gripper and person, k the
stiffness of arm and grasp. Their inertia is small compared with the person's push, so that u
follows at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles

# Maximum corrections: a patch between two bodies is brought out of one after the other.
_MOST = 16
# Tolerated depth, m.
_DEPTH = 1e-6


@dataclass(frozen=True)
class Pressing:
    """Pressing of the person on the cloth that two grippers hold.

    Attributes:
        displacement: (2,3) displacement of the held cloth, left and right, m.
        force: (k,3) force on each held node, N.
        owner: (k,) body that presses on it; −1 without one.
    """

    displacement: FloatArray
    force: FloatArray
    owner: IntArray


def press(x: FloatArray, side: IntArray, bodies: Obstacles, stiffness: float) -> Pressing:
    """Returns the displacement of held cloth that the person presses on, and the forces.

    Args:
        x: (k,3) positions to which the grippers take held nodes, m.
        side: (k,) 0 or 1, the gripper that takes them.
        bodies: bodies of the person at that time.
        stiffness: stiffness of a gripper's arm and grasp, N/m.
    """
    pressing = not_pressing(len(x))
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


def not_pressing(count: int) -> Pressing:
    """Returns the pressing on `count` held nodes that nothing presses on."""
    return Pressing(np.zeros((2, 3)), np.zeros((count, 3)), np.full(count, -1, dtype=np.int32))
