"""A person of round cones on articulated arms.

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

Sizes are in `measures.py`, the capsules of the bodies in `shape.py`; both are imported here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.measures import (
    ArmMeasures,
    BodyMeasures,
    Posture,
    shoulder_height,
)
from drake_dress.models.human.shape import Capsule, body_capsules, capsule_arrays
from drake_dress.models.rotation import rotation_about
from drake_dress.models.sides import SIDES, Side

__all__ = [
    "ArmMeasures",
    "ArmPose",
    "BodyMeasures",
    "Capsule",
    "Posture",
    "arm_points",
    "arm_rotations",
    "body_capsules",
    "capsule_arrays",
    "posed_capsules",
    "shoulder_height",
    "shoulder_joint",
]


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


def shoulder_joint(measures: BodyMeasures, posture: Posture, side: Side) -> FloatArray:
    """Returns the shoulder joint (3,) in the torso's frame, m."""
    sign = 1.0 if side == "left" else -1.0
    return np.array([0.0, sign * 0.5 * measures.shoulder_width, shoulder_height(measures, posture)])


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
    shoulder, own = shoulder_joint(measures, posture, side), measures.of(side)
    elbow = shoulder + upper @ np.array([0.0, 0.0, -own.upper_arm_length])
    hand = elbow + fore @ np.array([0.0, 0.0, -own.forearm_length])
    points = np.stack([shoulder, elbow, hand])
    if X_WTorso is None:
        return points
    rotation, origin = X_WTorso
    in_world: FloatArray = points @ rotation.T + origin
    return in_world


def posed_capsules(
    measures: BodyMeasures, posture: Posture, arms: Mapping[Side, ArmPose]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns ends (k,3), (k,3), in the torso's frame, and radii (k,2) of a person in a pose, m.

    They are the arguments of `Obstacles.resting`.

    Args:
        measures: sizes.
        posture: standing or sitting.
        arms: angles of both arms.
    """
    frames: dict[str, tuple[FloatArray, FloatArray]] = {"torso": (np.eye(3), np.zeros(3))}
    for side in SIDES:
        upper, fore = arm_rotations(side, arms[side])
        points = arm_points(measures, posture, side, arms[side])
        frames[f"{side}_upper_arm"] = upper, points[0]
        frames[f"{side}_forearm"] = fore, points[1]
    capsules = body_capsules(measures, posture)
    ends = np.empty((2, len(capsules), 3))
    for k, c in enumerate(capsules):
        rotation, origin = frames[c.body]
        ends[0, k], ends[1, k] = origin + rotation @ c.a_B, origin + rotation @ c.b_B
    return ends[0], ends[1], capsule_arrays(capsules)[2]
