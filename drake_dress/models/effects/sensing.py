"""Effects on the cameras: their clock and their pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from drake_dress.models.arrays import FloatArray
from drake_dress.models.effects.effect import CameraEffect, ClockEffect, parameter


@dataclass(frozen=True)
class TimeOffset(ClockEffect):
    """The cameras' clock is ahead of the robot's: a time stamp t means robot time t − offset.

    Args:
        offset: lead of the cameras' clock, s.
    """

    NAME = "time_offset"
    offset: float = parameter("s", -0.5, 0.5, 0.04)

    def apply(self, time: FloatArray) -> FloatArray:
        """Returns the times, s, at which frames with time stamp `time` were taken."""
        return time - self.offset

    def derivative(self, name: str, time: FloatArray) -> FloatArray:
        """Returns −1 for each time."""
        return np.full_like(time, -1.0)


@dataclass(frozen=True)
class CameraTranslation(CameraEffect):
    """The cameras' world frame is displaced: p_measured = p + t.

    Args:
        x: x of the displacement t, m.
        y: y of t, m.
        z: z of t, m.
    """

    NAME = "camera_translation"
    x: float = parameter("m", -0.3, 0.3, 0.01)
    y: float = parameter("m", -0.3, 0.3, 0.01)
    z: float = parameter("m", -0.3, 0.3, 0.01)

    def apply(self, position: FloatArray) -> FloatArray:
        """Returns the positions that cameras report for world points (…,3), m."""
        return position + np.array([self.x, self.y, self.z])

    def inverse(self, position: FloatArray) -> FloatArray:
        """Returns the world points of positions (…,3), m, that cameras report."""
        return position - np.array([self.x, self.y, self.z])

    def derivative(self, name: str, position: FloatArray) -> FloatArray:
        """Returns (…,3)."""
        return np.broadcast_to(np.eye(3)["xyz".index(name)], position.shape)


@dataclass(frozen=True)
class CameraRotation(CameraEffect):
    """The cameras' world frame is rotated about its origin: p_measured = R p.

    R is the rotation of the vector (x, y, z).

    Args:
        x: x of the rotation vector, rad.
        y: y of the rotation vector, rad.
        z: z of the rotation vector, rad.
    """

    NAME = "camera_rotation"
    x: float = parameter("rad", -0.5, 0.5, 0.015)
    y: float = parameter("rad", -0.5, 0.5, 0.015)
    z: float = parameter("rad", -0.5, 0.5, 0.015)

    def apply(self, position: FloatArray) -> FloatArray:
        """Returns the positions that cameras report for world points (…,3), m."""
        turned: FloatArray = position @ self._rotation.T
        return turned

    def inverse(self, position: FloatArray) -> FloatArray:
        """Returns the world points of positions (…,3), m, that cameras report."""
        turned: FloatArray = position @ self._rotation
        return turned

    def derivative(self, name: str, position: FloatArray) -> FloatArray:
        """Returns (…,3): ω × R p with ω the left Jacobian's column (Solà et al. 2018, eq. 145)."""
        vector = np.array([self.x, self.y, self.z])
        axis = np.eye(3)["xyz".index(name)]
        angle = float(np.linalg.norm(vector))
        omega = axis.copy()
        if angle > 1e-9:
            a = (1.0 - np.cos(angle)) / angle**2
            b = (angle - np.sin(angle)) / angle**3
            omega += a * np.cross(vector, axis) + b * np.cross(vector, np.cross(vector, axis))
        slope: FloatArray = np.cross(np.broadcast_to(omega, position.shape), self.apply(position))
        return slope

    @property
    def _rotation(self) -> FloatArray:
        matrix: FloatArray = Rotation.from_rotvec([self.x, self.y, self.z]).as_matrix()
        return matrix
