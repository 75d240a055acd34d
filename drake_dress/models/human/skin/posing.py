"""Poses a skin by linear blend skinning: each vertex moves by the mean of its bones' motions.

The arms' angles are those of `models/human/body.py`: at zero an arm hangs straight down, and its
elbow bends forward. How an arm is turned about its own axis at rest follows from its bent elbow.

Limitation: a joint that bends far loses volume at its inner side.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm_angles import arm_angles
from drake_dress.models.human.body import ArmPose, Posture, arm_rotations
from drake_dress.models.human.skin.skin import ALL_BONES, Skin
from drake_dress.models.rotation import rotation_about
from drake_dress.models.sides import SIDES, Side

# Sine of the elbow's flexion below which the forearm does not tell how the arm is turned.
_STRAIGHT = 0.1
# Rotation (3,3) and translation (3,).
_Motion = tuple[FloatArray, FloatArray]
_STILL: _Motion = (np.eye(3), np.zeros(3))


def rest_pose(skin: Skin, side: Side) -> ArmPose:
    """Returns the angles of an arm at rest; rotation and flexion are 0 if it is nearly straight."""
    shoulder, elbow, hand = (
        skin.joints[f"{side}_{name}"] for name in ("shoulder", "elbow", "knuckle_middle")
    )
    abduction, extension, rotation, flexion = map(
        float, arm_angles(side, _unit(elbow - shoulder), _unit(hand - elbow))[0]
    )
    if np.sin(flexion) < _STRAIGHT:
        return ArmPose(abduction, extension)
    return ArmPose(abduction, extension, rotation, flexion)


def bone_motions(
    skin: Skin, arms: Mapping[Side, ArmPose], posture: Posture = "standing"
) -> FloatArray:
    """Returns the motions (9,3,4) of `ALL_BONES` from rest to a pose: rotation, translation in m.

    Args:
        skin: at rest.
        arms: pose of each arm; an arm that is not given stays as it is at rest.
        posture: standing or sitting. Sitting persons have their thighs horizontal.
    """
    motions = dict.fromkeys(ALL_BONES, _STILL)
    for side, pose in arms.items():
        motions |= _arm_motions(skin, side, pose)
    if posture == "sitting":
        for side in SIDES:
            motions |= _leg_motions(skin, side)
    transform = np.stack([np.column_stack(motions[name]) for name in ALL_BONES])
    if posture == "sitting":
        transform[:, 2, 3] -= sitting_drop(skin)
    return transform


def moved_vertices(skin: Skin, motions: FloatArray) -> FloatArray:
    """Returns the vertices (n,3) of a skin whose bones moved by `motions` (9,3,4), m."""
    blended = (skin.weights @ motions.reshape(len(ALL_BONES), 12)).reshape(-1, 3, 4)
    turned = np.einsum("nij,nj->ni", blended[:, :, :3], skin.vertices)
    return np.asarray(turned + blended[:, :, 3])


def posed_vertices(
    skin: Skin, arms: Mapping[Side, ArmPose], posture: Posture = "standing"
) -> FloatArray:
    """Returns the vertices (n,3) of a posed skin in the torso's frame, m; see `bone_motions`."""
    return moved_vertices(skin, bone_motions(skin, arms, posture))


def sitting_drop(skin: Skin) -> float:
    """Returns how much lower the shoulders are when the person sits, m: thighs are horizontal."""
    drops = [skin.joints[f"{s}_hip"][2] - skin.joints[f"{s}_knee"][2] for s in SIDES]
    return float(np.mean(drops))


def _arm_motions(skin: Skin, side: Side, pose: ArmPose) -> dict[str, _Motion]:
    upper_rest, fore_rest = arm_rotations(side, rest_pose(skin, side))
    upper, fore = arm_rotations(side, pose)
    shoulder, elbow = skin.joints[f"{side}_shoulder"], skin.joints[f"{side}_elbow"]
    upper_motion = _about(upper @ upper_rest.T, shoulder, shoulder)
    moved_elbow = upper_motion[0] @ elbow + upper_motion[1]
    return {
        f"{side}_upper_arm": upper_motion,
        f"{side}_forearm": _about(fore @ fore_rest.T, elbow, moved_elbow),
    }


def _leg_motions(skin: Skin, side: Side) -> dict[str, _Motion]:
    """Returns motions that lay the thigh horizontally forward; the shin keeps its direction."""
    hip, knee = skin.joints[f"{side}_hip"], skin.joints[f"{side}_knee"]
    thigh = knee - hip
    flexion = float(np.arctan2(-thigh[2], thigh[0]))
    motion = _about(rotation_about("y", -flexion), hip, hip)
    moved_knee = motion[0] @ knee + motion[1]
    return {f"{side}_thigh": motion, f"{side}_shin": (np.eye(3), moved_knee - knee)}


def _about(rotation: FloatArray, point: FloatArray, moved: FloatArray) -> _Motion:
    """Returns the motion that rotates about a point, which moves to another place."""
    return rotation, moved - rotation @ point


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))
