"""Kinematics and gravity torques of an arm with four hinges.

Angles (4,) are abduction, extension, rotation, elbow flexion, rad, as in `body.py`; all vectors are
in the torso's frame, z up. The place and yaw of an upright torso do not change the gravity torques
on the arms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.body import (
    BodyMeasures,
    Posture,
    shoulder_joint,
)
from drake_dress.models.sides import Side

JOINT_NAMES = ("abduction", "extension", "rotation", "elbow")
GRAVITY = 9.81  # m/s², as in the plant
_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]


@dataclass(frozen=True)
class Arm:
    """Kinematics and gravity of one arm: two limbs of uniform density on a fixed shoulder.

    Attributes:
        measures: sizes and masses; those of the side are taken.
        posture: standing or sitting.
        side: left or right.
    """

    measures: BodyMeasures
    posture: Posture
    side: Side

    def __post_init__(self) -> None:
        object.__setattr__(self, "measures", self.measures.of(self.side))

    @cached_property
    def _weighed(self) -> tuple[float, float]:
        """Weight of the forearm times the place of its centre, and the same of both limbs, N."""
        (upper, fore), (of_upper, of_fore) = self.measures.arm_centers, self.measures.arm_masses
        return fore * GRAVITY * of_fore, GRAVITY * (upper * of_upper + of_fore)

    @property
    def shoulder(self) -> FloatArray:
        """Returns the shoulder joint (3,), m."""
        return shoulder_joint(self.measures, self.posture, self.side)

    @property
    def length(self) -> float:
        """Returns the reach of the hand from the shoulder, m."""
        return self.measures.upper_arm_length + self.measures.forearm_length

    def points(self, angles: FloatArray) -> FloatArray:
        """Returns shoulder, elbow, hand (3,3), m."""
        _, upper, fore = self._chain(angles)
        shoulder = self.shoulder
        return np.array([shoulder, shoulder + upper, shoulder + upper + fore])

    def hand(self, angles: FloatArray) -> FloatArray:
        """Returns the hand (3,), m."""
        _, upper, fore = self._chain(angles)
        hand: FloatArray = self.shoulder + upper + fore
        return hand

    def jacobian(self, angles: FloatArray) -> FloatArray:
        """Returns the Jacobian (3,4) of the hand, m/rad: axis × lever."""
        axes, upper, fore = self._chain(angles)
        both = upper + fore
        return _crossed(axes, np.array([both, both, both, fore])).T

    def elbow_jacobian(self, angles: FloatArray) -> FloatArray:
        """Returns the Jacobian (3,4) of the elbow, m/rad; its own hinge does not move it."""
        axes, upper, _ = self._chain(angles)
        return _crossed(axes, np.array([upper, upper, upper, np.zeros(3)])).T

    def potential(self, angles: FloatArray) -> float:
        """Returns U, J: weight times height of both limbs' centres, from the shoulder's height."""
        _, carried = self._weights(angles)
        return float(carried[0, 2])

    def gravity_torque(self, angles: FloatArray) -> FloatArray:
        """Returns (4,) −∂U/∂q, the gravity torque on each hinge, N·m.

        U = Σ m g z over the centres of both limbs.
        """
        axes, carried = self._weights(angles)
        torque: FloatArray = axes[:, 1] * carried[:, 0] - axes[:, 0] * carried[:, 1]
        return torque

    def gravity_stiffness(self, angles: FloatArray) -> FloatArray:
        """Returns (4,4) ∂²U/∂q², N·m/rad: positive where gravity pulls the arm back.

        A vector d that is carried by hinges i ≤ j, with i the nearer to the torso, has
        ∂²d/∂q_i∂q_j = a_i × (a_j × d) = a_j (a_i·d) − d (a_i·a_j).
        """
        axes, carried = self._weights(angles)
        nearer = np.triu((axes @ carried.T) * axes[:, 2] - (axes @ axes.T) * carried[:, 2])
        stiffness: FloatArray = nearer + np.triu(nearer, 1).T
        return stiffness

    def _weights(self, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns axes (4,3), and the load of each hinge (4,3): weight times lever, N·m.

        U changes with the height of the load.
        """
        axes, upper, fore = self._chain(angles)
        weight, both = self._weighed
        of_fore = weight * fore
        of_both = both * upper + of_fore
        return axes, np.stack([of_both, of_both, of_both, of_fore])

    def _chain(self, angles: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns the hinges' axes (4,3), shoulder → elbow and elbow → hand (3,), m."""
        sign = 1.0 if self.side == "left" else -1.0
        a, e, r, k = (float(angle) for angle in angles)
        ca, sa, ce, se = math.cos(a), sign * math.sin(a), math.cos(e), math.sin(e)
        cr, sr, ck, sk = math.cos(r), sign * math.sin(r), math.cos(k), math.sin(k)
        # the columns of the upper arm's orientation: `body.arm_rotations`, written out
        x = np.array([ce * cr, ca * sr + sa * se * cr, sa * sr - ca * se * cr])
        y = np.array([-ce * sr, ca * cr - sa * se * sr, sa * cr + ca * se * sr])
        z = np.array([se, -sa * ce, ca * ce])
        # abduction turns about the torso's x and carries the axis of extension along
        axes = np.array([[sign, 0.0, 0.0], [0.0, ca, sa], sign * z, -y])
        m = self.measures
        return axes, -m.upper_arm_length * z, m.forearm_length * (sk * x - ck * z)


def _crossed(a: FloatArray, b: FloatArray) -> FloatArray:
    """Returns the cross products (n,3) of rows; `np.cross` takes ten times as long for a few."""
    product: FloatArray = a[:, _NEXT] * b[:, _AFTER] - a[:, _AFTER] * b[:, _NEXT]
    return product


@dataclass(frozen=True)
class Arms:
    """Both arms with their joints, left then right.

    Attributes:
        arms: kinematics and masses.
        rest: (2,4) angles about which the plant's springs act, rad.
        limits: (2,2,4) lower and upper joint limits of each arm, rad.
        stiffness: (2,4) of each arm's joints, N·m/rad.
        damping: (2,4) of each arm's joints, N·m·s/rad.
        has_tone: whether each arm has muscle tone; one without is paralysed.
    """

    arms: tuple[Arm, Arm]
    rest: FloatArray
    limits: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    has_tone: tuple[bool, bool] = (True, True)
