"""The column that a robot arm's base stands on in pictures; nothing collides with it."""

from __future__ import annotations

from pydrake.geometry import Cylinder
from pydrake.math import RigidTransform

from drake_dress.models.arm.panda import STAND_RADIUS

STAND_COLOR = (0.62, 0.64, 0.67)


def arm_stand(X_WB: RigidTransform, floor: float = 0.0) -> tuple[Cylinder, RigidTransform] | None:
    """Returns the column and its pose in the world; None where the base is not above the floor.

    Args:
        X_WB: pose of the upright base.
        floor: its height, m.
    """
    height = float(X_WB.translation()[2]) - floor
    if height <= 0.0:
        return None
    return Cylinder(STAND_RADIUS, height), X_WB @ RigidTransform([0.0, 0.0, -0.5 * height])
