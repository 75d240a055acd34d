"""Springs, dampers, limits and muscle tone of a person's arm joints.

A stiff joint is one with narrow limits, stiff springs, or both. An arm without muscle tone is
paralysed: it has no motion of its own, and nothing but its tissue holds it against gravity.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm import JOINT_NAMES
from drake_dress.models.sides import Side

Limits = tuple[float, float]


@dataclass(frozen=True)
class JointParameters:
    """Stiffness, damping, limits and tone of the arms' joints.

    Attributes:
        shoulder_stiffness: of each of the shoulder's three hinges, N·m/rad.
        shoulder_damping: of each of these hinges, N·m·s/rad.
        elbow_stiffness: N·m/rad.
        elbow_damping: N·m·s/rad.
        abduction_limits: smallest and largest angle, rad; the limits below likewise.
        extension_limits: backward is positive.
        rotation_limits: outward is positive.
        elbow_limits: of its flexion.
        tone: share of the arm's weight that its muscles carry, 0 to 1. An arm without any is
            paralysed.
        left: the left arm's, if they differ.
        right: the right arm's, if they differ.

    Raises:
        UserError: stiffness or damping is negative or not finite, limits are not two finite angles
            in ascending order, or the tone is out of range.
    """

    shoulder_stiffness: float = 6.0
    shoulder_damping: float = 3.0
    elbow_stiffness: float = 3.6
    elbow_damping: float = 1.2
    abduction_limits: Limits = (-0.6, 2.6)
    extension_limits: Limits = (-2.6, 1.2)
    rotation_limits: Limits = (-1.2, 1.2)
    elbow_limits: Limits = (0.0, 2.5)
    tone: float = 1.0
    left: JointParameters | None = None
    right: JointParameters | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in ("left", "right"):
                continue
            if field.name.endswith("_limits"):
                expected = _expected_of_limits(value)
            elif field.name == "tone":
                good = _is_number(value) and 0.0 <= value <= 1.0
                expected = None if good else "a number from 0 to 1"
            else:
                good = _is_number(value) and value >= 0.0
                expected = None if good else "a finite number, 0 or more"
            if expected is not None:
                raise UserError("person.joints", field.name, f"is {value!r}, expected {expected}")

    def of(self, side: Side) -> JointParameters:
        """Returns the parameters of one arm."""
        own = self.left if side == "left" else self.right
        return self if own is None else own

    @cached_property
    def limits(self) -> FloatArray:
        """Lower and upper limits (2,4) of abduction, extension, rotation, elbow, rad."""
        return np.array([getattr(self, f"{name}_limits") for name in JOINT_NAMES]).T

    @cached_property
    def stiffness(self) -> FloatArray:
        """Stiffness (4,) of the same joints, N·m/rad."""
        return np.array([self.shoulder_stiffness] * 3 + [self.elbow_stiffness])

    @cached_property
    def damping(self) -> FloatArray:
        """Damping (4,) of the same joints, N·m·s/rad."""
        return np.array([self.shoulder_damping] * 3 + [self.elbow_damping])


def _is_number(value: object) -> bool:
    return (
        isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))
    )


def _expected_of_limits(value: object) -> str | None:
    """Returns what was expected instead of `value`; None if it is a valid pair of limits."""
    if not isinstance(value, tuple | list) or len(value) != 2 or not all(map(_is_number, value)):
        return "two finite angles in rad"
    if value[0] >= value[1]:
        return "lower before upper, rad"
    return None
