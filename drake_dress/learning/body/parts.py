"""Parts of the body and bones of the reduced skeleton, by MakeHuman's bones."""

from __future__ import annotations

import numpy as np

from drake_dress.learning.body.source import Source
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.skin.body_file import BONES, JOINTS, MIDDLE_JOINTS, PARTS

# Beginnings of the names of MakeHuman's bones. The first that fits counts.
_PART_OF = {
    "upperleg": "thigh",
    "lowerleg": "shin",
    "foot": "foot",
    "toe": "foot",
    "clavicle": "trunk",
    "shoulder01": "trunk",
    "upperarm": "upper_arm",
    "lowerarm": "forearm",
    "wrist": "palm",
    "metacarpal": "palm",
    "finger1": "thumb",
    "finger": "fingers",
    "neck": "neck",
    "spine": "trunk",
    "pelvis": "trunk",
    "root": "trunk",
    "breast": "trunk",
}
_BONE_OF = {
    "thigh": "thigh",
    "shin": "shin",
    "foot": "shin",
    "upper_arm": "upper_arm",
    "forearm": "forearm",
    "palm": "forearm",
    "thumb": "forearm",
    "fingers": "forearm",
}
# Joints of the package by the bone whose head they are.
_HEADS = {
    "neck": "neck01",
    "head": "head",
    "shoulder": "upperarm01.L",
    "elbow": "lowerarm01.L",
    "wrist": "wrist.L",
    "knuckle_index": "finger2-1.L",
    "knuckle_middle": "finger3-1.L",
    "knuckle_little": "finger5-1.L",
    "thumb": "finger1-2.L",
    "hip": "upperleg01.L",
    "knee": "lowerleg01.L",
    "ankle": "foot.L",
}


def part_of(bone: str) -> str:
    """Returns the part that a bone of MakeHuman moves; bones of the face move the head."""
    return next((part for start, part in _PART_OF.items() if bone.startswith(start)), "head")


def part_numbers(source: Source) -> IndexArray:
    """Returns (n,) the index in `PARTS` of the part that moves each vertex most."""
    total = np.zeros((source.vertex_count, len(PARTS)))
    for column, bone in enumerate(source.bones):
        total[:, PARTS.index(part_of(bone))] += source.weights[:, column]
    return np.argmax(total, axis=1)


def bone_weights(source: Source) -> FloatArray:
    """Returns (n,5) weights of `BONES` on vertices of the left half; rows sum to 1."""
    total = np.zeros((source.vertex_count, len(BONES)))
    for column, bone in enumerate(source.bones):
        if not bone.endswith(".R"):
            name = _BONE_OF.get(part_of(bone), "torso")
            total[:, BONES.index(name)] += source.weights[:, column]
    return total / np.maximum(total.sum(axis=1, keepdims=True), 1e-12)


def joint_rows(source: Source) -> list[int]:
    """Returns the rows of the package's joints among the points: middle ones, then left ones."""
    names = [*MIDDLE_JOINTS, *JOINTS]
    return [source.vertex_count + source.bones.index(_HEADS[name]) for name in names]
