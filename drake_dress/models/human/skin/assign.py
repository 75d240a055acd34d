"""Assigns the vertices of a scan to parts of the body by their nearest bone."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.skin.body_file import PARTS
from drake_dress.models.human.skin.skin import ALL_BONES
from drake_dress.models.sides import SIDES

# Radii over the stature: the distance from a bone counts in these. From the girths of the means of
# ANSUR II; the trunk has a bone on each side, half way between the spine and the shoulder.
_RADIUS = {
    "trunk": 0.05,
    "neck": 0.035,
    "head": 0.055,
    "upper_arm": 0.030,
    "forearm": 0.025,
    "palm": 0.020,
    "thigh": 0.055,
    "shin": 0.033,
}
_BONE_OF = {"upper_arm": "upper_arm", "forearm": "forearm", "palm": "forearm"} | {
    "thigh": "thigh",
    "shin": "shin",
}


def parts_by_distance(
    vertices: FloatArray, joints: Mapping[str, FloatArray]
) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Returns parts (n,), sides (n,) and skin weights (n,9) of a scan's vertices.

    Args:
        vertices: (n,3) in the torso's frame, m.
        joints: of the body, m.
    """
    stature = float(np.ptp(vertices[:, 2]))
    segments = _segments(joints)
    distances = np.stack(
        [
            _distance(vertices, start, end) / (_RADIUS[part] * stature)
            for part, _, start, end in segments
        ]
    )
    nearest = np.argmin(distances, axis=0)
    parts = np.array([PARTS.index(part) for part, *_ in segments])
    bones = np.array([_bone(part, side) for part, side, *_ in segments])
    sides = np.array([{"left": 1, "right": -1, "": 0}[side] for _, side, *_ in segments])
    # a vertex of the middle of the body has the side on which it is
    own = np.where(vertices[:, 1] > 0.0, 1, -1)
    side_of_vertex = np.where(sides[nearest] == 0, own, sides[nearest])
    return parts[nearest], side_of_vertex, np.eye(len(ALL_BONES))[bones[nearest]]


def _segments(
    joints: Mapping[str, FloatArray],
) -> list[tuple[str, str, FloatArray, FloatArray]]:
    """Returns part, side, start and end of each bone."""
    neck, head = joints["neck"], joints["head"]
    segments = [("neck", "", neck, head), ("head", "", head, head + (head - neck))]
    middle = 0.5 * (joints["left_shoulder"] + joints["right_shoulder"])
    for side in SIDES:
        shoulder, elbow, wrist, knuckle, hip, knee, ankle = (
            joints[f"{side}_{name}"]
            for name in ("shoulder", "elbow", "wrist", "knuckle_middle", "hip", "knee", "ankle")
        )
        inner = 0.5 * (shoulder + middle)
        segments += [
            ("trunk", "", middle, inner),
            ("trunk", "", inner, hip),
            ("upper_arm", side, shoulder, elbow),
            ("forearm", side, elbow, wrist),
            ("palm", side, wrist, knuckle + (knuckle - wrist)),
            ("thigh", side, hip, knee),
            ("shin", side, knee, ankle),
        ]
    return segments


def _bone(part: str, side: str) -> int:
    name = _BONE_OF.get(part)
    return ALL_BONES.index("torso" if name is None else f"{side}_{name}")


def _distance(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Returns the distance (n,) of points from a segment, m."""
    along = end - start
    share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - share[:, None] * along, axis=1))
