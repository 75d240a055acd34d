"""The skin of a person whose joints are known, such as those of a log."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm_angles import arm_angles
from drake_dress.models.human.body import ArmPose, Posture
from drake_dress.models.human.skin.posing import bone_motions, moved_vertices, sitting_drop
from drake_dress.models.human.skin.skin import ALL_BONES, Skin
from drake_dress.models.sides import SIDES, Side

# Sine of the elbow's flexion below which the arm's turn about its axis fades to none: a straight
# arm does not tell it. The hand then is less than 2 cm beside its place.
_STRAIGHT = 0.05


def motions_at_joints(
    skin: Skin, joint_position: FloatArray, posture: Posture = "standing"
) -> FloatArray:
    """Returns the motions (9,3,4) of a skin's bones from rest to given joints, m, world.

    The shoulders' line turns the body about the vertical. Where the skin has other lengths than the
    person, its arms are moved to the shoulders and stretched along their bones, so that elbows and
    hands are at the given places.

    Args:
        skin: at rest.
        joint_position: (6,3) shoulder, elbow, hand of the left, then of the right arm, m.
        posture: standing or sitting.
    """
    left, right = joint_position[0], joint_position[3]
    rotation = _heading(left - right)
    in_torso = joint_position @ rotation
    arms = {side: _arm_pose(side, in_torso[3 * i : 3 * i + 3]) for i, side in enumerate(SIDES)}
    motions = bone_motions(skin, arms, posture)
    shoulders = np.mean([skin.joints[f"{side}_shoulder"] for side in SIDES], axis=0)
    if posture == "sitting":
        shoulders = shoulders - [0.0, 0.0, sitting_drop(skin)]
    motions[:, :, 3] -= shoulders
    middle = 0.5 * (left + right) @ rotation
    for i, side in enumerate(SIDES):
        _stretch(skin, side, motions, in_torso[3 * i : 3 * i + 3] - middle)
    motions = rotation @ motions
    motions[:, :, 3] += 0.5 * (left + right)
    return motions


def vertices_at_joints(
    skin: Skin, joint_position: FloatArray, posture: Posture = "standing"
) -> FloatArray:
    """Returns the vertices (n,3) of a skin at given joints, m, world; see `motions_at_joints`."""
    return moved_vertices(skin, motions_at_joints(skin, joint_position, posture))


def _stretch(skin: Skin, side: Side, motions: FloatArray, joints: FloatArray) -> None:
    """Makes the motions of an arm's bones start and end at its joints (3,3), m."""
    names = ("shoulder", "elbow", "knuckle_middle")
    rest = [skin.joints[f"{side}_{name}"] for name in names]
    for k, bone in enumerate(("upper_arm", "forearm")):
        motion = motions[ALL_BONES.index(f"{side}_{bone}")]
        start, end = (motion[:, :3] @ p + motion[:, 3] for p in rest[k : k + 2])
        length = np.linalg.norm(end - start)
        along = (end - start) / length
        stretch = np.linalg.norm(joints[k + 1] - joints[k]) / length - 1.0
        motion[:, 3] -= start
        motion += np.outer(stretch * along, along @ motion)
        motion[:, 3] += joints[k]


def _heading(across: FloatArray) -> FloatArray:
    """Returns the orientation (3,3) of an upright torso with a line from right to left shoulder."""
    y = across * np.array([1.0, 1.0, 0.0])
    y /= np.linalg.norm(y)
    z = np.array([0.0, 0.0, 1.0])
    return np.stack([np.cross(y, z), y, z], axis=1)


def _arm_pose(side: Side, joints: FloatArray) -> ArmPose:
    """Returns the angles of an arm with joints (3,3) in the torso's frame."""
    limbs = np.diff(joints, axis=0)
    upper, fore = limbs / np.linalg.norm(limbs, axis=1, keepdims=True)
    abduction, extension, rotation, flexion = map(float, arm_angles(side, upper, fore)[0])
    told = min(1.0, abs(np.sin(flexion)) / _STRAIGHT)
    return ArmPose(abduction, extension, told * rotation, flexion)
