"""A triangle mesh as a thin shell of tetrahedra, for programs that only show volumes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray, IntArray

# Cosine between the normals of a face and its nodes, below which the face gets nodes of its own.
_LEAST_COSINE = 0.1


@dataclass(frozen=True)
class Shell:
    """A shell about a triangle mesh: two layers of m nodes each, the lower layer first.

    Attributes:
        owner: (m,) mesh node that each node of a layer belongs to.
        faces: (F,3) the mesh's triangles, as indices into `owner`.
        tetrahedra: (3F,4) indices into the nodes of both layers.
        thickness: distance between the layers, m.
    """

    owner: IntArray
    faces: IntArray
    tetrahedra: IntArray
    thickness: float

    def nodes(self, position: FloatArray) -> FloatArray:
        """Returns (2m,3) nodes of both layers about the mesh's (n,3) `position`, m."""
        at = position[self.owner]
        offset = 0.5 * self.thickness * _node_normals(at, self.faces)
        nodes: FloatArray = np.concatenate([at - offset, at + offset])
        return nodes


def make_shell(position: FloatArray, faces: IntArray, thickness: float) -> Shell:
    """Returns a shell without inverted tetrahedra.

    Where a mesh folds back on itself, no normal suits all faces of a node. Faces there get nodes
    of their own.

    Args:
        position: (n,3) of the mesh, m.
        faces: (F,3) its triangles.
        thickness: thickness of the shell, m.
    """
    area = _areas(position, faces)
    own = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-300)
    alone = np.zeros(len(faces), dtype=bool)
    while True:
        # removing faces changes the normals of those that stay
        normals = _node_normals(position, faces[~alone])
        lean = np.einsum("fki,fi->fk", normals[faces], own).min(axis=1) < _LEAST_COSINE
        if not np.any(lean & ~alone):
            break
        alone |= lean
    count = len(position)
    split = faces.astype(np.int64).copy()
    split[alone] = count + np.arange(3 * int(alone.sum())).reshape(-1, 3)
    owner = np.concatenate([np.arange(count), faces[alone].ravel()])
    # nodes that lost all their faces stay, without tetrahedra
    return Shell(
        owner.astype(np.int32),
        split.astype(np.int32),
        _tetrahedra(split, len(owner)),
        thickness,
    )


def _areas(position: FloatArray, faces: IntArray) -> FloatArray:
    corner = position[faces]
    areas: FloatArray = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return areas


def _node_normals(position: FloatArray, faces: IntArray) -> FloatArray:
    area = _areas(position, faces)
    normal = np.zeros_like(position)
    for k in range(3):
        np.add.at(normal, faces[:, k], area)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normals: FloatArray = normal / np.maximum(length, 1e-12)
    return normals


def _tetrahedra(faces: IndexArray, count: int) -> IntArray:
    """Returns three tetrahedra of each triangle's prism.

    Each side of a prism is cut from the lower node with the smaller index, so that neighbours cut
    their common side alike.
    """
    # rotate each triangle so that its smallest index comes first
    first = np.argmin(faces, axis=1)
    a, b, c = (faces[np.arange(len(faces)), (first + k) % 3] for k in range(3))
    up_a, up_b, up_c = a + count, b + count, c + count
    straight = b < c
    tetrahedra = np.concatenate(
        [
            np.stack([a, b, c, np.where(straight, up_c, up_b)], axis=1),
            np.where(
                straight[:, None],
                np.stack([a, b, up_c, up_b], axis=1),
                np.stack([a, up_b, c, up_c], axis=1),
            ),
            np.stack([a, up_b, up_c, up_a], axis=1),
        ]
    )
    return tetrahedra.astype(np.int32)
