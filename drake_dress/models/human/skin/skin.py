"""A person's skin: a closed mesh with joints, skin weights and the parts of the body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.skin.body_file import PARTS, BodyFile
from drake_dress.models.sides import SIDES, Side

# Bones of the whole body, in the order of the skin weights.
ALL_BONES = (
    "torso",
    *(f"{side}_{name}" for side in SIDES for name in ("upper_arm", "forearm", "thigh", "shin")),
)


@dataclass(frozen=True)
class Skin:
    """A skin at rest. Frame: x forward, y left, z up; m.

    The origin is on the floor below the middle of the shoulder joints, as that of the torso's frame
    of a standing person (`models/human/body.py`).

    Attributes:
        vertices: (n,3), m.
        faces: (F,3) triangles, counter-clockwise from outside.
        joints: position (3,) of each joint, m; arms have `left_shoulder`, `left_elbow`,
            `left_wrist` and `left_knuckle_middle`, the middle of the hand.
        weights: (n,9) skin weights of `ALL_BONES`; rows sum to 1.
        parts: (n,) indices in `PARTS`.
        sides: (n,) 1 left, -1 right, 0 on the plane of symmetry.
    """

    vertices: FloatArray
    faces: IndexArray
    joints: Mapping[str, FloatArray]
    weights: FloatArray
    parts: IndexArray
    sides: IndexArray

    @property
    def stature(self) -> float:
        """Height of the body, m."""
        return float(np.ptp(self.vertices[:, 2]))

    @property
    def volume(self) -> float:
        """Volume inside the skin, m³."""
        return enclosed_volume(self.vertices, self.faces)

    def faces_of(self, parts: tuple[str, ...], side: Side | None = None) -> IndexArray:
        """Returns the faces all of whose vertices belong to some parts, of one side if given."""
        chosen = np.isin(self.parts, [PARTS.index(part) for part in parts])
        if side is not None:
            chosen &= self.sides * (1 if side == "left" else -1) >= 0
        return self.faces[chosen[self.faces].all(axis=1)]

    def faces_without(self, parts: tuple[str, ...]) -> IndexArray:
        """Returns the faces none of whose vertices belong to some parts."""
        return self.faces_of(tuple(part for part in PARTS if part not in parts))


def scaled(skin: Skin, factor: float) -> Skin:
    """Returns a skin that is larger by a factor in all directions."""
    joints = {name: factor * place for name, place in skin.joints.items()}
    return replace(skin, vertices=factor * skin.vertices, joints=joints)


def enclosed_volume(vertices: FloatArray, faces: IndexArray) -> float:
    """Returns the volume inside a closed mesh, m³, by the divergence theorem."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", np.cross(a, b), c) / 6.0)


def skin_of_points(body: BodyFile, points: FloatArray) -> Skin:
    """Returns the skin for the points (P,3) of the left half of a body; see `BodyFile.points`."""
    vertices, joints = body.whole(points)
    middle = 0.5 * (joints["left_shoulder"] + joints["right_shoulder"])
    origin = np.array([middle[0], 0.0, vertices[:, 2].min()])
    mirrored = body.other_half()[body.faces][:, ::-1]
    rest = slice(body.middle, None)
    sides = np.ones(body.vertex_count, dtype=np.int64)
    sides[: body.middle] = 0
    return Skin(
        vertices=vertices - origin,
        faces=np.vstack([body.faces, mirrored]),
        joints={name: place - origin for name, place in joints.items()},
        weights=_whole_weights(body),
        parts=np.concatenate([body.parts, body.parts[rest]]),
        sides=np.concatenate([sides, -sides[rest]]),
    )


def _whole_weights(body: BodyFile) -> FloatArray:
    """Returns (2n-m,9): vertices on the plane of symmetry follow the legs of both sides."""
    left, none = body.weights[:, 1:], np.zeros_like(body.weights[:, 1:])
    torso, rest = body.weights[:, :1], slice(body.middle, None)
    on_left = np.hstack([torso, left, none])
    on_left[: body.middle, 1:5] *= 0.5
    on_left[: body.middle, 5:] = on_left[: body.middle, 1:5]
    on_right = np.hstack([torso, none, left])[rest]
    return np.vstack([on_left, on_right])
