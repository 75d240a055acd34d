"""The Panda by Franka Emika: geometry and limits from its manufacturer.

Source: Franka Control Interface documentation, "Robot and interface specifications": modified
Denavit-Hartenberg parameters (Craig) and the limits of the joints.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.arm.chain import JointLimits, SerialArm
from drake_dress.models.arm.clearance import ArmShape, Capsules
from drake_dress.models.arrays import FloatArray

# Radius of the column that an arm's base is drawn on, m.
STAND_RADIUS = 0.08

LIMITS = JointLimits(
    lower=np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973]),
    upper=np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973]),
    speed=np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61]),
    acceleration=np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0]),
    torque=np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0]),
)
# a, m, d, m, and α, rad, of each joint.
_GEOMETRY = np.array(
    [
        [0.0, 0.333, 0.0],
        [0.0, 0.0, -0.5 * np.pi],
        [0.0, 0.316, 0.5 * np.pi],
        [0.0825, 0.0, 0.5 * np.pi],
        [-0.0825, 0.384, -0.5 * np.pi],
        [0.0, 0.0, 0.5 * np.pi],
        [0.088, 0.0, 0.5 * np.pi],
    ]
)
# Distance from the last joint to the flange, from there to the midpoint of the hand's fingertips,
# m, and rotation of the hand about the flange's axis, rad.
FLANGE, FINGERTIPS, HAND_TURN = 0.107, 0.1034, -0.25 * np.pi


def panda(base: FloatArray) -> SerialArm:
    """Returns a Panda with its base at X_WB (4,4); the tool is between its hand's fingertips."""
    joints = np.stack([_link(*row) for row in _GEOMETRY])
    tool = np.eye(4)
    c, s = np.cos(HAND_TURN), np.sin(HAND_TURN)
    tool[:2, :2] = [[c, -s], [s, c]]
    tool[2, 3] = FLANGE + FINGERTIPS
    return SerialArm(base, joints, tool, LIMITS)


def _link(a: float, d: float, alpha: float) -> FloatArray:
    """Returns X_PL (4,4) at q = 0: Rx(α) Tx(a) Tz(d)."""
    c, s = np.cos(alpha), np.sin(alpha)
    return np.array(
        [[1.0, 0.0, 0.0, a], [0.0, c, -s, -s * d], [0.0, s, c, c * d], [0.0, 0.0, 0.0, 1.0]]
    )


# The capsule of least volume that encloses each link's collision mesh: ends of its axis and radius,
# m. The last one is the hand's, in its own frame.
_CAPSULES = np.array(
    [
        [-0.0567, -0.0001, 0.0154, -0.0001, 0.0, 0.0514, 0.1045],
        [0.0, -0.0534, 0.0008, -0.0001, -0.0002, -0.1398, 0.0763],
        [-0.0001, -0.1418, 0.0, -0.0001, 0.0017, 0.0536, 0.0762],
        [0.0829, 0.0426, 0.0004, 0.0005, 0.0004, -0.0802, 0.0693],
        [-0.0816, 0.0832, 0.0004, 0.0, -0.0001, 0.0425, 0.0695],
        [0.0002, 0.0104, -0.2438, 0.0, 0.0638, 0.003, 0.0674],
        [0.087, 0.0087, -0.0004, 0.0231, 0.0069, 0.006, 0.0751],
        [-0.0051, -0.0051, 0.0733, 0.0329, 0.033, 0.0805, 0.0494],
        [-0.0001, 0.0605, 0.0311, -0.0001, -0.0765, 0.0211, 0.0492],
    ]
)
# The hand is part of the last link.
_OWNER = np.array([0, 1, 2, 3, 4, 5, 6, 7, 7])


def _shape() -> ArmShape:
    ends = _CAPSULES[:, :6].reshape(-1, 2, 3).copy()
    c, s = np.cos(HAND_TURN), np.sin(HAND_TURN)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    ends[-1] = ends[-1] @ turn.T + [0.0, 0.0, FLANGE]
    return ArmShape(_OWNER, Capsules(ends[:, 0], ends[:, 1], _CAPSULES[:, 6]))


SHAPE = _shape()
