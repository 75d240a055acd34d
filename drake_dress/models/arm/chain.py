"""A serial arm of revolute joints: where its links are, and how they move with its joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class JointLimits:
    """What the joints of an arm may do; (J,) each.

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
        """Returns limits within these: a share of speeds and accelerations, and rad of room."""
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
        base: (4,4) X_WB, where it stands.
        joints: (J,4,4) X_PL of each link L in its parent P at q = 0.
        tool: (4,4) X_LT of the tool in the last link.
        limits: of the joints.
    """

    base: FloatArray
    joints: FloatArray
    tool: FloatArray
    limits: JointLimits

    @property
    def count(self) -> int:
        """J."""
        return len(self.joints)

    def links(self, q: FloatArray) -> FloatArray:
        """Returns (J+2,4,4) X_WL of the base, each link, and the tool, at joints `q` (J,), rad."""
        turned = np.zeros((self.count, 4, 4))
        c, s = np.cos(q), np.sin(q)
        turned[:, 0, 0], turned[:, 0, 1] = c, -s
        turned[:, 1, 0], turned[:, 1, 1] = s, c
        turned[:, 2, 2] = turned[:, 3, 3] = 1.0
        steps = self.joints @ turned
        poses = np.empty((self.count + 2, 4, 4))
        poses[0] = self.base
        for i in range(self.count):
            poses[i + 1] = poses[i] @ steps[i]
        poses[-1] = poses[-2] @ self.tool
        return poses

    def tool_position(self, q: FloatArray) -> FloatArray:
        """Returns p_WT (3,), m, at joints `q` (J,), rad."""
        p: FloatArray = self.links(q)[-1, :3, 3]
        return p

    def tool_jacobian(self, links: FloatArray) -> FloatArray:
        """Returns (6,J) J of the tool's velocity, m/s, above its angular velocity, rad/s.

        Args:
            links: of `SerialArm.links`.
        """
        axis = links[1:-1, :3, 2]
        moved = moved_by(links, links[-1:, :3, 3], np.array([self.count]))[0]
        jacobian: FloatArray = np.vstack([moved, axis.T])
        return jacobian


def moved_by(links: FloatArray, points: FloatArray, owner: npt.NDArray[np.int64]) -> FloatArray:
    """Returns (K,3,J) ∂(velocity of points)/∂(joint rates).

    Args:
        links: (J+2,4,4) of `SerialArm.links`.
        points: (K,3) p_W, m.
        owner: (K,) link that each is fixed to: 0 the base, J the last one.
    """
    axis, origin = links[1:-1, :3, 2], links[1:-1, :3, 3]
    arm = points[:, None, :] - origin[None]
    # a × r by hand: np.cross costs three times as much on so little
    x = axis[:, 1] * arm[..., 2] - axis[:, 2] * arm[..., 1]
    y = axis[:, 2] * arm[..., 0] - axis[:, 0] * arm[..., 2]
    z = axis[:, 0] * arm[..., 1] - axis[:, 1] * arm[..., 0]
    moves = np.arange(1, len(axis) + 1) <= owner[:, None]
    jacobian: FloatArray = np.stack([x, y, z], axis=1) * moves[:, None, :]
    return jacobian


def rotation_error(now: FloatArray, asked: FloatArray) -> FloatArray:
    """Returns (3,) the rotation vector in W that turns `now` (3,3) to `asked` (3,3), rad.

    At half a turn its axis is one of two; half a turn less rounding is as exact as any.
    """
    r = asked @ now.T
    sine = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    cosine = 0.5 * (np.trace(r) - 1.0)
    length = float(np.linalg.norm(sine))
    angle = float(np.arctan2(length, cosine))
    if length > 1e-6:
        vector: FloatArray = sine * (angle / length)
        return vector
    if cosine > 0.0:
        return sine
    # half a turn: r = 2 a aᵀ − 1
    k = int(np.argmax(np.diag(r)))
    axis = r[:, k] + np.eye(3)[k]
    half: FloatArray = np.pi * axis / np.linalg.norm(axis)
    return half
