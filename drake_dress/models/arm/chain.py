"""Kinematics of a serial arm of revolute joints."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.vector3 import length


@dataclass(frozen=True)
class JointLimits:
    """Limits of an arm's joints; (J,) each.

    Attributes:
        lower, upper: positions, rad.
        speed: rad/s. acceleration: rad/s². torque: N·m.
    """

    lower: FloatArray
    upper: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    torque: FloatArray

    def within(self, share: float, room: float) -> JointLimits:
        """Returns tighter limits: a share of speed and acceleration, position `room` rad inside."""
        return JointLimits(
            self.lower + room,
            self.upper - room,
            share * self.speed,
            share * self.acceleration,
            self.torque,
        )


@dataclass(frozen=True)
class SerialArm:
    """An arm of J revolute joints, each about the z axis of its own link.

    Attributes:
        base: (4,4) X_WB of the base.
        joints: (J,4,4) X_PL of each link L in its parent P at q = 0.
        tool: (4,4) X_LT of the tool in the last link.
        limits: limits of the joints.
    """

    base: FloatArray
    joints: FloatArray
    tool: FloatArray
    limits: JointLimits

    @property
    def count(self) -> int:
        """Number of joints J."""
        return len(self.joints)

    def links(self, q: FloatArray) -> FloatArray:
        """Returns (J+2,4,4) X_WL of the base, each link, and the tool, at joints `q` (J,), rad."""
        poses: FloatArray = place_links(self.base, self.joints, self.tool, q)
        return poses

    def tool_position(self, q: FloatArray) -> FloatArray:
        """Returns p_WT (3,), m, at joints `q` (J,), rad."""
        p: FloatArray = self.links(q)[-1, :3, 3]
        return p

    def tool_jacobian(self, links: FloatArray) -> FloatArray:
        """Returns the Jacobian (6,J) of the tool: velocity, m/s, above angular velocity, rad/s.

        Args:
            links: (J+2,4,4) of `SerialArm.links`.
        """
        jacobian: FloatArray = find_tool_jacobian(links)
        return jacobian


# The functions below are called from compiled code, too: a 5 ms cycle has no time for small arrays.


@nb.njit(cache=True, nogil=True)
def place_links(base, joints, tool, q):  # type: ignore[no-untyped-def]
    """Returns (J+2,4,4) X_WL; arguments as of `SerialArm`, q (J,) rad."""
    count = len(q)
    poses = np.zeros((count + 2, 4, 4))
    poses[0] = base
    for i in range(count):
        _compose(poses[i], joints[i], poses[i + 1])
        c, s = np.cos(q[i]), np.sin(q[i])
        for a in range(3):
            x, y = poses[i + 1, a, 0], poses[i + 1, a, 1]
            poses[i + 1, a, 0], poses[i + 1, a, 1] = c * x + s * y, c * y - s * x
    _compose(poses[count], tool, poses[count + 1])
    return poses


@nb.njit(cache=True, nogil=True)
def _compose(first, second, out):  # type: ignore[no-untyped-def]
    for a in range(3):
        for b in range(4):
            out[a, b] = (
                first[a, 0] * second[0, b] + first[a, 1] * second[1, b] + first[a, 2] * second[2, b]
            )
        out[a, 3] += first[a, 3]
    out[3, 3] = 1.0


@nb.njit(cache=True, nogil=True)
def find_tool_jacobian(links):  # type: ignore[no-untyped-def]
    """Returns (6,J), as `SerialArm.tool_jacobian`."""
    count = len(links) - 2
    jacobian = np.zeros((6, count))
    moved_by(links, links[-1, :3, 3], count, jacobian)
    for j in range(count):
        for a in range(3):
            jacobian[3 + a, j] = links[j + 1, a, 2]
    return jacobian


@nb.njit(cache=True, nogil=True)
def moved_by(links, point, owner, out):  # type: ignore[no-untyped-def]
    """Writes ∂(velocity of a point)/∂(joint rates) to the first three rows of `out`.

    Args:
        links: (J+2,4,4) of `SerialArm.links`.
        point: (3,) p_W, m.
        owner: link that the point is fixed to: 0 the base, J the last one.
        out: (3+,J) of zeros.
    """
    for j in range(min(owner, len(links) - 2)):
        x = point[0] - links[j + 1, 0, 3]
        y = point[1] - links[j + 1, 1, 3]
        z = point[2] - links[j + 1, 2, 3]
        u, v, w = links[j + 1, 0, 2], links[j + 1, 1, 2], links[j + 1, 2, 2]
        out[0, j] = v * z - w * y
        out[1, j] = w * x - u * z
        out[2, j] = u * y - v * x


@nb.njit(cache=True, nogil=True)
def rotation_error(now, asked):  # type: ignore[no-untyped-def]
    """Returns (3,) the rotation vector in W that turns `now` (3,3) to `asked` (3,3), rad.

    Within rounding of half a turn it is half a turn about one of the two possible axes.
    """
    r = np.zeros((3, 3))
    for a in range(3):
        for b in range(3):
            for c in range(3):
                r[a, b] += asked[a, c] * now[b, c]
    vector = np.array(
        [0.5 * (r[2, 1] - r[1, 2]), 0.5 * (r[0, 2] - r[2, 0]), 0.5 * (r[1, 0] - r[0, 1])]
    )
    cosine = 0.5 * (r[0, 0] + r[1, 1] + r[2, 2] - 1.0)
    sine = length(vector)
    if sine > 1e-6:
        return vector * (np.arctan2(sine, cosine) / sine)
    if cosine > 0.0:
        return vector
    # half a turn: r = 2 a aᵀ − 1
    k = 0
    for a in range(1, 3):
        if r[a, a] > r[k, k]:
            k = a
    axis = r[:, k].copy()
    axis[k] += 1.0
    return axis * (np.pi / length(axis))
