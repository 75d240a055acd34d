"""Sizes and masses of a person."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Literal, get_args

from drake_dress.errors import UserError
from drake_dress.models.round_cone import solid
from drake_dress.models.sides import SIDES, Side

Posture = Literal["standing", "sitting"]

# Masses of the default person's limbs, kg. Those of other limbs follow with their volumes.
UPPER_ARM_MASS, FOREARM_MASS = 1.6, 1.2
# Radius below which an arm does not get when its thickness is changed, m.
THINNEST = 0.005


@dataclass(frozen=True)
class ArmMeasures:
    """Sizes of one arm, m, and masses, kg, where they differ from those of both arms.

    Attributes:
        upper_arm_length: from shoulder to elbow, m.
        forearm_length: from the elbow to the middle of the hand, m.
        upper_arm_radius: radius of the upper arm at the shoulder, m.
        forearm_radius: radius of the forearm at the elbow, m.
        hand_radius: radius of the hand, m.
        upper_arm_mass: mass of the upper arm, kg.
        forearm_mass: mass of the forearm with its hand, kg.
        elbow_radius: radius of the upper arm at the elbow, m.
        wrist_radius: radius of the forearm at its end in the hand, m.

    Raises:
        UserError: a value is not a positive finite number.
    """

    upper_arm_length: float | None = None
    forearm_length: float | None = None
    upper_arm_radius: float | None = None
    forearm_radius: float | None = None
    hand_radius: float | None = None
    upper_arm_mass: float | None = None
    forearm_mass: float | None = None
    elbow_radius: float | None = None
    wrist_radius: float | None = None

    def __post_init__(self) -> None:
        _check_positive("person", self)

    @property
    def given(self) -> dict[str, float]:
        """The given values by name."""
        return {name: value for name, value in vars(self).items() if value is not None}


@dataclass(frozen=True)
class BodyMeasures:
    """Sizes of a person, m, and masses, kg.

    Attributes:
        shoulder_height: height of the shoulder joints above the floor, standing, m.
        shoulder_width: distance between the shoulder joints, m.
        upper_arm_length: from shoulder to elbow, m.
        forearm_length: from the elbow to the middle of the hand, m.
        upper_arm_radius: radius of the upper arm at the shoulder, m.
        forearm_radius: radius of the forearm at the elbow, m.
        hand_radius: radius of the hand, m.
        chest_width: width of the chest, m.
        chest_depth: depth of the chest, m.
        torso_length: length of the trunk below the shoulders, m.
        hip_width: width of the hips, m.
        neck_radius: radius of the neck below the head, m.
        head_radius: radius of the head, m.
        leg_length: length of a leg, m.
        thigh_radius: radius of a thigh at the hip, m.
        upper_arm_mass: mass of an upper arm, kg. If empty, it follows from the volume: 1.6 kg for
            the default sizes.
        forearm_mass: mass of a forearm with its hand, kg. If empty, it follows from the volume:
            1.2 kg for the default sizes.
        elbow_radius: radius of the upper arm at the elbow, m. If empty, as at the shoulder.
        wrist_radius: radius of the forearm at its end in the hand, m. If empty, as at the elbow.
        knee_radius: radius of thigh and lower leg at the knee, m. If empty, that of the thigh; of
            one who sits, 0.7 of it below the knee.
        ankle_radius: radius of the lower leg at the ankle, m. If empty, as at the knee.
        neck_base_radius: radius of the neck between the shoulders, m. If empty, as below the head.
        neck_length: from the shoulders' line to the head, m. If empty, 0.12 m.
        waist_width: width of the waist, m. If empty and the trunk has a waist, that of the chest.
        waist_depth: depth of the waist, m. If empty and the trunk has a waist, that of the chest.
        hip_depth: depth of the hips, m. If empty and the trunk has a waist, that of the chest. A
            trunk without waist_width, waist_depth and hip_depth has none: it is as wide and deep
            as the chest.
        left: sizes of the left arm that differ.
        right: sizes of the right arm that differ.

    Raises:
        UserError: a value is not a positive finite number, or the trunk reaches below the floor.
    """

    shoulder_height: float = 1.40
    shoulder_width: float = 0.36
    upper_arm_length: float = 0.29
    forearm_length: float = 0.32
    upper_arm_radius: float = 0.045
    forearm_radius: float = 0.038
    hand_radius: float = 0.040
    chest_width: float = 0.32
    chest_depth: float = 0.20
    torso_length: float = 0.52
    hip_width: float = 0.32
    neck_radius: float = 0.055
    head_radius: float = 0.095
    leg_length: float = 0.85
    thigh_radius: float = 0.075
    upper_arm_mass: float | None = None
    forearm_mass: float | None = None
    elbow_radius: float | None = None
    wrist_radius: float | None = None
    knee_radius: float | None = None
    ankle_radius: float | None = None
    neck_base_radius: float | None = None
    neck_length: float | None = None
    waist_width: float | None = None
    waist_depth: float | None = None
    hip_depth: float | None = None
    left: ArmMeasures | None = None
    right: ArmMeasures | None = None

    def __post_init__(self) -> None:
        _check_positive("person", self)
        if self.torso_length >= self.shoulder_height - 0.5 * self.leg_length:
            raise UserError(
                "person",
                "torso_length",
                f"is {self.torso_length} m, expected less than shoulder_height less half of "
                f"leg_length, {self.shoulder_height - 0.5 * self.leg_length:g} m",
            )

    def of(self, side: Side) -> BodyMeasures:
        """Returns the measures with one side's arm as that of both sides."""
        own = self.left if side == "left" else self.right
        if self.left is None and self.right is None:
            return self
        return replace(self, left=None, right=None, **(own.given if own else {}))

    @property
    def has_waist(self) -> bool:
        """Whether the trunk has a waist and hips of its own."""
        return any(v is not None for v in (self.waist_width, self.waist_depth, self.hip_depth))

    @property
    def upper_arm_radii(self) -> tuple[float, float]:
        """Radii of an upper arm at shoulder and elbow, m."""
        return self.upper_arm_radius, _or(self.elbow_radius, self.upper_arm_radius)

    @property
    def forearm_radii(self) -> tuple[float, float]:
        """Radii of a forearm at the elbow and in the hand, m."""
        return self.forearm_radius, _or(self.wrist_radius, self.forearm_radius)

    @property
    def joint_radii(self) -> tuple[float, float, float]:
        """Radii of an arm at shoulder, elbow and hand, m."""
        elbow = max(self.forearm_radius, _or(self.elbow_radius, 0.0))
        return self.upper_arm_radius, elbow, self.hand_radius

    @property
    def arm_centers(self) -> tuple[float, float]:
        """Places of the centres of mass of upper arm and forearm, as shares of their lengths."""
        return (
            _center(self.upper_arm_length, self.upper_arm_radii),
            _center(self.forearm_length, self.forearm_radii),
        )

    @cached_property
    def arm_masses(self) -> tuple[float, float]:
        """Masses of an upper arm and of a forearm with its hand, kg.

        A mass that is not given is that of the default person times the ratio of the volumes.
        """
        upper, fore = self._arm_volumes()
        of_default = BodyMeasures()._arm_volumes()
        return (
            _or(self.upper_arm_mass, UPPER_ARM_MASS * (upper / of_default[0])),
            _or(self.forearm_mass, FOREARM_MASS * (fore / of_default[1])),
        )

    def _arm_volumes(self) -> tuple[float, float]:
        """Returns the volumes of an upper arm and of a forearm with its hand, m³.

        Limbs are frusta between their joints, and the hand is a sphere.
        """
        hand = 4.0 / 3.0 * math.pi * self.hand_radius**3
        return (
            _frustum(self.upper_arm_length, *self.upper_arm_radii),
            _frustum(self.forearm_length, *self.forearm_radii) + hand,
        )

    def thickened(self, added: float) -> BodyMeasures:
        """Returns the measures with arms and hands thicker by `added`, m, and the same masses."""
        changes: dict[str, Any] = _thicker(self, added)
        changes["upper_arm_mass"], changes["forearm_mass"] = self.arm_masses
        for side in SIDES:
            own = getattr(self, side)
            if own is not None:
                upper, fore = self.of(side).arm_masses
                masses = {"upper_arm_mass": upper, "forearm_mass": fore}
                changes[side] = replace(own, **(_thicker(own, added) | masses))
        return replace(self, **changes)


def shoulder_height(measures: BodyMeasures, posture: Posture) -> float:
    """Returns the height of the shoulder joints above the floor, m.

    Raises:
        UserError: `posture` is neither standing nor sitting.
    """
    if posture not in get_args(Posture):
        raise UserError(
            "person", "posture", f"is {posture!r}, expected one of {', '.join(get_args(Posture))}"
        )
    if posture == "standing":
        return measures.shoulder_height
    # the seat is at knee height, half a leg; the trunk keeps its length
    return measures.shoulder_height - 0.5 * measures.leg_length


def arm_radius_names(measures: BodyMeasures | ArmMeasures) -> list[str]:
    """Returns the names of the given radii of arms and hands."""
    names = ("upper_arm_radius", "elbow_radius", "forearm_radius", "wrist_radius", "hand_radius")
    return [name for name in names if getattr(measures, name) is not None]


def _thicker(measures: BodyMeasures | ArmMeasures, added: float) -> dict[str, Any]:
    return {
        name: max(getattr(measures, name) + added, THINNEST) for name in arm_radius_names(measures)
    }


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value


def _frustum(length: float, first: float, second: float) -> float:
    """Returns the volume of a frustum of a cone, m³."""
    return math.pi / 3.0 * length * (first * first + first * second + second * second)


def _center(length: float, radii: tuple[float, float]) -> float:
    return 0.5 if radii[0] == radii[1] else solid(length, radii).center / length


def _check_positive(source: str, measures: BodyMeasures | ArmMeasures) -> None:
    """Checks that all given values are positive.

    Raises:
        UserError: one is not.
    """
    for field in fields(measures):
        value = getattr(measures, field.name)
        if (value is None and field.default is None) or isinstance(value, ArmMeasures):
            continue
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (number and math.isfinite(value) and value > 0.0):
            unit = "kg" if field.name.endswith("mass") else "m"
            raise UserError(
                source, field.name, f"is {value!r}, expected a positive number of {unit}"
            )
