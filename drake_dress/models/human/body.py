"""A person as capsules and spheres on articulated arms.

Bodies: `torso` (with neck, head, pelvis and legs; it does not move), and `{side}_upper_arm` and
`{side}_forearm` (with the hand). In a body's frame the arm hangs along −z: the upper arm from its
shoulder joint at the origin, the forearm from its elbow joint at the origin. The torso's frame has
its origin on the floor below the shoulders' midpoint.

Angles of an arm, zero when it hangs straight down: abduction opens it sideways, extension moves
the hand backward, rotation turns it about its own axis (elbow crease inward positive), elbow
flexion brings the forearm forward.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Posture = Literal["standing", "sitting"]
Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True)
class BodyMeasures:
    """Sizes of a person, m, and masses, kg. The shoulder height is that of the joints, standing."""

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


@dataclass(frozen=True)
class ArmPose:
    """Angles of an arm, rad."""

    abduction: float = 0.0
    extension: float = 0.0
    rotation: float = 0.0
    elbow_flexion: float = 0.0


@dataclass(frozen=True)
class Capsule:
    """A capsule fixed in `body`; a sphere where a_B equals b_B. Ends (3,), m, radius, m."""

    body: str
    a_B: FloatArray  # noqa: N815
    b_B: FloatArray  # noqa: N815
    radius: float


def shoulder_height(measures: BodyMeasures, posture: Posture) -> float:
    """Returns the height of the shoulder joints above the floor, m."""
    if posture == "standing":
        return measures.shoulder_height
    # the seat is at knee height, half a leg; the trunk stays as long as it is
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
        _about("x", sign * pose.abduction)
        @ _about("y", pose.extension)
        @ _about("z", sign * pose.rotation)
    )
    return upper, upper @ _about("y", -pose.elbow_flexion)


def arm_points(measures: BodyMeasures, posture: Posture, side: Side, pose: ArmPose) -> FloatArray:
    """Returns shoulder, elbow and hand (3,3) in the torso's frame, m."""
    upper, fore = arm_rotations(side, pose)
    shoulder = shoulder_joint(measures, posture, side)
    elbow = shoulder + upper @ np.array([0.0, 0.0, -measures.upper_arm_length])
    hand = elbow + fore @ np.array([0.0, 0.0, -measures.forearm_length])
    return np.stack([shoulder, elbow, hand])


def _about(axis: str, angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    if axis == "x":
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]], dtype=np.float64)
    if axis == "y":
        return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]], dtype=np.float64)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], dtype=np.float64)
