"""The skin of a person whose joints are known, such as those of a log."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm_angles import arm_angles
from drake_dress.models.human.body import ArmPose, Posture
from drake_dress.models.human.skin.posing import posed_vertices, sitting_drop
from drake_dress.models.human.skin.skin import Skin
from drake_dress.models.sides import SIDES, Side

# Sine of the elbow's flexion below which the arm's turn about its axis fades to none: a straight
# arm does not tell it. The hand then is less than 2 cm beside its place.
_STRAIGHT = 0.05


def vertices_at_joints(
    skin: Skin, joint_position: FloatArray, posture: Posture = "standing"
) -> FloatArray:
    """Returns the vertices (n,3) of a skin whose arms point along given joints, m, world.

    The shoulders' line turns the body about the vertical. Limbs keep the skin's own lengths, so
    elbows and hands are at the given places if the skin has the person's lengths.

    Args:
        skin: at rest.
        joint_position: (6,3) shoulder, elbow, hand of the left, then of the right arm, m.
        posture: standing or sitting.
    """
    left, right = joint_position[0], joint_position[3]
    rotation = _heading(left - right)
    in_torso = joint_position @ rotation
    arms = {side: _arm_pose(side, in_torso[3 * i : 3 * i + 3]) for i, side in enumerate(SIDES)}
    vertices = posed_vertices(skin, arms, posture)
    shoulders = np.mean([skin.joints[f"{side}_shoulder"] for side in SIDES], axis=0)
    if posture == "sitting":
        shoulders = shoulders - [0.0, 0.0, sitting_drop(skin)]
    return np.asarray((vertices - shoulders) @ rotation.T + 0.5 * (left + right))


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
