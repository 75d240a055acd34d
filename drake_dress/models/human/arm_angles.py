"""Joint angles of an arm from the directions of its limbs: the inverse of `body.arm_rotations`.

With the upper arm along u and the forearm along f, unit vectors in the torso's frame, and s = 1 on
the left, −1 on the right:

    u = Rx(s a) Ry(e) (0, 0, −1) = (−sin e, sin(s a) cos e, −cos(s a) cos e)
    f = Rx(s a) Ry(e) Rz(s r) (sin k, 0, −cos k)

with abduction a, extension e, rotation r, elbow flexion k. Two sets of angles give the same
direction of a limb: (a, e) and (a + π, π − e).
"""

from __future__ import annotations

from math import asin, atan2, cos, hypot, pi, sin

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.sides import Side


def arm_angles(side: Side, upper: FloatArray, fore: FloatArray) -> FloatArray:
    """Returns (2,4) both sets of abduction, extension, rotation, elbow flexion, rad, in ±π.

    Args:
        side: left or right.
        upper: (3,) unit vector from shoulder to elbow, in the torso's frame.
        fore: (3,) unit vector from elbow to hand.
    """
    sign = 1.0 if side == "left" else -1.0
    x, y, z = (float(v) for v in upper)
    e = asin(max(-1.0, min(1.0, -x)))
    ways = ((atan2(y, -z), e), (atan2(-y, z), pi - e))
    angles = [_with_forearm(sign, about_x, extension, fore) for about_x, extension in ways]
    return np.array(angles)


def _with_forearm(
    sign: float, about_x: float, extension: float, fore: FloatArray
) -> tuple[float, ...]:
    c, s = cos(about_x), sin(about_x)
    ce, se = cos(extension), sin(extension)
    x, y, z = (float(v) for v in fore)
    # in the frame Rx(s a) Ry(e) of the upper arm before its rotation
    b, d = c * y + s * z, c * z - s * y
    u, w = ce * x - se * d, se * x + ce * d
    turn = atan2(b, u)
    return sign * about_x, _in_one_turn(extension), sign * turn, atan2(hypot(u, b), -w)


def _in_one_turn(angle: float) -> float:
    return (angle + pi) % (2.0 * pi) - pi
