"""An armhole as the person whose hand goes into it has it: relative to the torso."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.dressing.linking import arm_linking_number, torso_interior
from drake_dress.models.dressing.sleeve import sleeve_state
from drake_dress.models.human.arm import Arm

# From a point to its mirror image across the torso's middle plane.
_MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Armhole:
    """An armhole and the arm that may be in it, in the torso's frame.

    Attributes:
        center: (3,), m.
        into: unit vector (3,) into the sleeve.
        loop: (k,3) nodes in order, m.
        joints: (3,3) shoulder, elbow, hand, m.
    """

    center: FloatArray
    into: FloatArray
    loop: FloatArray
    joints: FloatArray

    @property
    def is_entered(self) -> bool:
        """Returns whether the arm is through it (linking number ±1)."""
        shoulder, elbow, hand = self.joints
        interior = torso_interior(shoulder, _MIRROR * shoulder)
        return abs(arm_linking_number(self.loop, shoulder, elbow, hand, interior)) == 1

    @property
    def depth(self) -> float:
        """Returns how far the hand is beyond its plane, m."""
        return float((self.joints[2] - self.center) @ self.into)

    @property
    def beside(self) -> float:
        """Returns how far the hand is from its axis, m."""
        offset = self.joints[2] - self.center
        return float(np.linalg.norm(offset - self.depth * self.into))


def find_armhole(
    loop: FloatArray, sign: float, arm: Arm, angles: FloatArray, yaw: float, origin: FloatArray
) -> Armhole:
    """Returns the armhole that the nodes `loop` (k,3), m, world, go round.

    Args:
        loop: nodes in order.
        sign: of the loop, see `loop_orientation`.
        arm: the arm of that side.
        angles: of the arm (4,), rad.
        yaw: of the torso about the vertical, rad.
        origin: of the torso's frame (3,), m, world.
    """
    c, s = np.cos(yaw), np.sin(yaw)
    in_torso = (loop - origin) @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    sleeve = sleeve_state(in_torso, np.arange(len(loop)), sign)
    return Armhole(sleeve.p_c, -sleeve.v_c, in_torso, arm.points(angles))
