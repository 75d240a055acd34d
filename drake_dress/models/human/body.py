"""A person as capsules and spheres on articulated arms.

Bodies: `torso` (with neck, head, pelvis and legs; it can only turn), and `{side}_upper_arm` and
`{side}_forearm` (with the hand). In a body's frame the arm hangs along −z: the upper arm from its
shoulder joint at the origin, the forearm from its elbow joint at the origin. The torso's frame has
its origin on the floor below the shoulders' midpoint.

The angles of an arm are zero when it hangs straight down. Abduction opens it sideways, extension
moves the hand backward, rotation turns it about its own axis (outward positive: the hand of a bent
arm moves away from the body), and elbow flexion brings the forearm forward. They apply in this
order from the torso outward. Both sides use the same signs, so equal angles give mirrored arms.

Limitation: at zero abduction an upper arm penetrates the side of the chest by half the chest width
plus the arm's radius minus half the shoulder width (2.5 cm by default).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Literal, get_args

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.rotation import rotation_about
from drake_dress.models.sides import SIDES, Side

Posture = Literal["standing", "sitting"]


@dataclass(frozen=True)
class BodyMeasures:
    """Sizes of a person, m, and masses, kg.

    Attributes:
        shoulder_height: height of the shoulder joints above the floor, standing, m.
        shoulder_width: distance between the shoulder joints, m.
        upper_arm_length: from shoulder to elbow, m.
        forearm_length: from the elbow to the middle of the hand, m.
        upper_arm_radius: radius of the upper arm, m.
        forearm_radius: radius of the forearm, m.
        hand_radius: radius of the hand, m.
        chest_width: width of the chest, m.
        chest_depth: depth of the chest, m.
        torso_length: length of the trunk below the shoulders, m.
        hip_width: width of the hips, m.
        neck_radius: radius of the neck, m.
        head_radius: radius of the head, m.
        leg_length: length of a leg, m.
        thigh_radius: radius of a thigh, m.
        upper_arm_mass: mass of an upper arm, kg.
        forearm_mass: mass of a forearm with its hand, kg.

    Raises:
        UserError: a value is not a positive finite number, or the trunk does not fit: it reaches
            below the floor, or is deeper than wide.
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
    upper_arm_mass: float = 1.6
    forearm_mass: float = 1.2

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not (number and np.isfinite(value) and value > 0.0):
                unit = "kg" if field.name.endswith("mass") else "m"
                raise UserError(
                    "person", field.name, f"is {value!r}, expected a positive number of {unit}"
                )
        if self.torso_length >= self.shoulder_height - 0.5 * self.leg_length:
            raise UserError(
                "person",
                "torso_length",
                f"is {self.torso_length} m, expected less than shoulder_height less half of "
                f"leg_length, {self.shoulder_height - 0.5 * self.leg_length:g} m",
            )
        if self.chest_depth > self.chest_width:
            raise UserError(
                "person",
                "chest_depth",
                f"is {self.chest_depth} m, expected at most chest_width, {self.chest_width} m",
            )


@dataclass(frozen=True)
class ArmPose:
    """Angles of an arm, rad; signs and order as in the module docstring.

    Raises:
        UserError: an angle is not a finite number.
    """

    abduction: float = 0.0
    extension: float = 0.0
    rotation: float = 0.0
    elbow_flexion: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not (number and np.isfinite(value)):
                raise UserError("arm", field.name, f"is {value!r}, expected an angle in rad")


@dataclass(frozen=True)
class Capsule:
    """A round cone fixed in `body`: a capsule if its radii are equal, a sphere if a_B equals b_B.

    Attributes:
        body: name of the body.
        a_B, b_B: (3,) ends of its axis, m.
        radius: radius at end a, m.
        end_radius: radius at end b, m; None: the same.
    """

    body: str
    a_B: FloatArray
    b_B: FloatArray
    radius: float
    end_radius: float | None = None

    @property
    def radii(self) -> tuple[float, float]:
        """Radii at both ends, m."""
        return self.radius, self.radius if self.end_radius is None else self.end_radius


def capsule_arrays(capsules: Sequence[Capsule]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns ends (k,3), (k,3), in the frames of their bodies, and radii (k,2), m."""
    a, b = (np.array([getattr(c, end) for c in capsules]).reshape(-1, 3) for end in ("a_B", "b_B"))
    return a, b, np.array([c.radii for c in capsules]).reshape(-1, 2)


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


def shoulder_joint(measures: BodyMeasures, posture: Posture, side: Side) -> FloatArray:
    """Returns the shoulder joint (3,) in the torso's frame, m."""
    sign = 1.0 if side == "left" else -1.0
    return np.array([0.0, sign * 0.5 * measures.shoulder_width, shoulder_height(measures, posture)])


def body_capsules(measures: BodyMeasures, posture: Posture) -> tuple[Capsule, ...]:
    """Returns the capsules of all bodies, each in its body's frame."""
    m = measures
    top = shoulder_height(m, posture)
    capsules: list[Capsule] = []

    def add(body: str, a: list[float], b: list[float], radius: float) -> None:
        capsules.append(Capsule(body, np.array(a), np.array(b), radius))

    half_depth = 0.5 * m.chest_depth
    # trunk: three capsules side by side, as deep as the chest; the outer ones end at its width
    offset = 0.5 * m.chest_width - half_depth
    bottom = top - m.torso_length + half_depth
    for y in (-offset, 0.0, offset):
        add("torso", [0, y, bottom], [0, y, top - half_depth - 0.02], half_depth)
    # shoulder girdle, from joint to joint
    half = 0.5 * m.shoulder_width
    add("torso", [0, -half, top], [0, half, top], m.upper_arm_radius)
    neck_top = top + 0.12
    add("torso", [0, 0, top], [0, 0, neck_top], m.neck_radius)
    add(
        "torso",
        [0.015, 0, neck_top + 0.9 * m.head_radius],
        [0.015, 0, neck_top + 1.2 * m.head_radius],
        m.head_radius,
    )
    hip = 0.5 * m.hip_width - m.thigh_radius
    pelvis = top - m.torso_length + m.thigh_radius
    add("torso", [0, -hip, pelvis], [0, hip, pelvis], 1.15 * m.thigh_radius)
    for y in (-hip, hip):
        if posture == "standing":
            add("torso", [0, y, pelvis], [0, y, m.thigh_radius], m.thigh_radius)
        else:
            knee = 0.5 * m.leg_length
            add("torso", [0, y, pelvis], [knee, y, pelvis], m.thigh_radius)
            add("torso", [knee, y, pelvis], [knee, y, m.thigh_radius], 0.7 * m.thigh_radius)
    for side in SIDES:
        add(f"{side}_upper_arm", [0, 0, 0], [0, 0, -m.upper_arm_length], m.upper_arm_radius)
        add(f"{side}_forearm", [0, 0, 0], [0, 0, -m.forearm_length], m.forearm_radius)
        add(f"{side}_forearm", [0, 0, -m.forearm_length], [0, 0, -m.forearm_length], m.hand_radius)
    return tuple(capsules)


def arm_rotations(side: Side, pose: ArmPose) -> tuple[FloatArray, FloatArray]:
    """Returns the orientations (3,3) of upper arm and forearm in the torso's frame."""
    sign = 1.0 if side == "left" else -1.0
    upper = (
        rotation_about("x", sign * pose.abduction)
        @ rotation_about("y", pose.extension)
        @ rotation_about("z", sign * pose.rotation)
    )
    return upper, upper @ rotation_about("y", -pose.elbow_flexion)


def arm_points(
    measures: BodyMeasures,
    posture: Posture,
    side: Side,
    pose: ArmPose,
    X_WTorso: tuple[FloatArray, FloatArray] | None = None,
) -> FloatArray:
    """Returns shoulder, elbow and hand (3,3), m, in the torso's frame or in the world.

    Args:
        measures: sizes.
        posture: standing or sitting.
        side: left or right.
        pose: angles of that arm.
        X_WTorso: rotation (3,3) and origin (3,) of the torso's frame in the world, m; None leaves
            the points in the torso's frame.
    """
    upper, fore = arm_rotations(side, pose)
    shoulder = shoulder_joint(measures, posture, side)
    elbow = shoulder + upper @ np.array([0.0, 0.0, -measures.upper_arm_length])
    hand = elbow + fore @ np.array([0.0, 0.0, -measures.forearm_length])
    points = np.stack([shoulder, elbow, hand])
    if X_WTorso is None:
        return points
    rotation, origin = X_WTorso
    in_world: FloatArray = points @ rotation.T + origin
    return in_world
