"""Motion of grippers and limbs in a dressing, taken from a run's log."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog


@dataclass(frozen=True)
class DressingMotion:
    """Smooth motions through the samples of a log.

    Attributes:
        time: (T,) times of the samples, s.
        grippers: (T,2,3) positions of left and right, m.
        first, second: (T,c,3) ends of the person's capsules, m.
        radius: (c,) radii of the capsules, m.
    """

    time: FloatArray
    grippers: FloatArray
    first: FloatArray
    second: FloatArray
    radius: FloatArray
    _splines: tuple[CubicSpline, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        parts = (self.grippers, self.first, self.second)
        object.__setattr__(self, "_splines", tuple(CubicSpline(self.time, p) for p in parts))

    @staticmethod
    def of(log: RunLog) -> DressingMotion:
        """Returns the motion in a log."""
        first, second, radius = log.capsules
        grippers = np.stack([log.gripper_position[side] for side in SIDES], axis=1)
        return DressingMotion(log.time, grippers, first, second, radius)

    @staticmethod
    def read(path: Path) -> DressingMotion:
        """Returns the motion of a run."""
        with RunLog.open(path) as log:
            return DressingMotion.of(log)

    def grippers_at(self, time: float) -> FloatArray:
        """Returns the positions (2,3) of the grippers, m."""
        at: FloatArray = self._splines[0](time)
        return at

    def person_at(self, time: float) -> Obstacles:
        """Returns the capsules with their velocities, without rotation about their own axes."""
        a, b = self._splines[1](time), self._splines[2](time)
        va, vb = self._splines[1](time, 1), self._splines[2](time, 1)
        axis = b - a
        size2 = np.maximum((axis**2).sum(axis=1, keepdims=True), 1e-12)
        omega = np.cross(axis, vb - va) / size2
        return Obstacles(a, b, self.radius, va, omega)
