"""An armhole in the frame of the person's torso."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.dressing.linking import arm_linking_number, torso_interior
from drake_dress.models.dressing.sleeve import sleeve_state
from drake_dress.models.human.arm import Arm

# Mirrors a point across the torso's mid-sagittal plane.
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
        """Returns whether the arm is through the armhole (linking number ±1)."""
        shoulder, elbow, hand = self.joints
        interior = torso_interior(shoulder, _MIRROR * shoulder)
        return abs(arm_linking_number(self.loop, shoulder, elbow, hand, interior)) == 1

    @property
    def depth(self) -> float:
        """Returns the distance of the hand beyond the armhole's plane, m."""
        return float((self.joints[2] - self.center) @ self.into)

    @property
    def beside(self) -> float:
        """Returns the distance of the hand from the armhole's axis, m."""
        offset = self.joints[2] - self.center
        return float(np.linalg.norm(offset - self.depth * self.into))


def find_armhole(
    loop: FloatArray, sign: float, arm: Arm, angles: FloatArray, yaw: float, origin: FloatArray
) -> Armhole:
    """Returns the armhole along the nodes `loop` (k,3), m, in the world frame.

    Args:
        loop: nodes in order.
        sign: orientation of the loop, see `loop_orientation`.
        arm: the arm of that side.
        angles: joint angles of the arm (4,), rad.
        yaw: yaw of the torso about the vertical, rad.
        origin: origin of the torso's frame (3,) in the world frame, m.
    """
    c, s = np.cos(yaw), np.sin(yaw)
    in_torso = (loop - origin) @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    sleeve = sleeve_state(in_torso, np.arange(len(loop)), sign)
    return Armhole(sleeve.p_c, -sleeve.v_c, in_torso, arm.points(angles))
