"""The Panda's links as solids of a few hundred triangles each, for pictures and replays.

They are the collision meshes of the package `example-robot-data`. The hand and its fingers are part
of the last link.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import trimesh

from drake_dress.models.arm.description import HAND_PARTS, panda_source
from drake_dress.models.arm.panda import STAND_RADIUS
from drake_dress.models.arrays import FloatArray, IntArray

# Triangles that meet at a smaller angle are shaded as one smooth surface, rad.
_SMOOTH = 0.6
_LINKS = 8


@dataclass(frozen=True)
class LinkSolid:
    """Mesh of a link; a vertex at a crease is repeated for each side of the crease.

    Attributes:
        vertices: (k,3) in the link's frame, m.
        normals: (k,3) outward unit vectors.
        faces: (F,3) indices.
    """

    vertices: FloatArray
    normals: FloatArray
    faces: IntArray


@cache
def panda_solids() -> tuple[LinkSolid, ...]:
    """Returns the base and links 1 to 7, in the frames of `SerialArm.links`.

    Raises:
        FileNotFoundError: the package with the meshes has no Panda.
    """
    folder = panda_source() / "meshes" / "collision"

    def read(name: str, X_LM: FloatArray) -> trimesh.Trimesh:
        mesh = trimesh.load(folder / f"{name}.stl", force="mesh")
        return mesh.apply_transform(X_LM)

    parts = [[read(f"link{i}", np.eye(4))] for i in range(_LINKS)]
    parts[-1] += [read(name, X_LM) for name, X_LM in HAND_PARTS]
    return tuple(_solid(meshes) for meshes in parts)


def stand(height: float) -> LinkSolid:
    """Returns the column of an arm's base, `height` m long, in the frame of the upright base."""
    column = trimesh.creation.cylinder(STAND_RADIUS, height, sections=32)
    return _solid([column.apply_translation([0.0, 0.0, -0.5 * height])])


def joined(first: LinkSolid, second: LinkSolid) -> LinkSolid:
    """Returns two solids of the same frame as one."""
    return LinkSolid(
        np.concatenate([first.vertices, second.vertices]),
        np.concatenate([first.normals, second.normals]),
        np.concatenate([first.faces, second.faces + len(first.vertices)]),
    )


def _solid(meshes: Sequence[trimesh.Trimesh]) -> LinkSolid:
    mesh: Any = trimesh.util.concatenate(meshes)
    mesh.merge_vertices()
    shaded = trimesh.graph.smooth_shade(mesh, angle=_SMOOTH)
    return LinkSolid(
        np.asarray(shaded.vertices, dtype=np.float64),
        np.asarray(shaded.vertex_normals, dtype=np.float64),
        np.asarray(shaded.faces, dtype=np.int32),
    )
