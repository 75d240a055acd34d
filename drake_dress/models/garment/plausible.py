"""Refuses well-formed meshes that cannot be a garment.

One missing or damaged line shifts all later node numbers, or moves a node, but the file still
reads as a mesh. Such damage shows in edges that cross the garment, in more surface than a garment
of that size has, and in nodes far from all their neighbours. All measures are ratios, so the unit
of the file does not matter. In sound garments (coats at 2 to 6 cm, five third-party files) the
longest edge reaches 0.15 of the diagonal, and the area 0.8 of its square.
"""

from __future__ import annotations

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.edges import border_edges, unique_edges
from drake_dress.models.garment.files.raw import RawMesh
from drake_dress.models.garment.mesh import face_areas

# An edge crosses the garment if it is longer than this fraction of the bounding box's diagonal, and
# than the median edge times this factor: a mesh that is coarse throughout is not damaged.
_LONGEST, _LONGER = 0.35, 3.0
_LARGEST_AREA = 2.5  # area over the square of the diagonal: three layers of a garment
# A node is off its surface if its shortest edge is longer than `_FAR` times the diagonal, and if
# the faces around it form a spike. Inside the mesh, their angles at the node then sum to less than
# `_SPIKE_ANGLE`, rad; on the border, its shortest edge is longer than `_SPIKE_RATIO` times the mean
# edge opposite to it.
_FAR = 0.03
_SPIKE_ANGLE = 2.5
_SPIKE_RATIO = 4.0

_CAUSES = "are node numbers shifted by a missing line, or a coordinate damaged?"


def check_plausible(mesh: RawMesh) -> None:
    """Checks that edges, nodes and area are plausible for a garment.

    Args:
        mesh: in m, without duplicate nodes.

    Raises:
        UserError: nodes are far from their neighbours, edges cross the garment, there is too much
            surface, or faces have no area.
    """
    x, faces = mesh.position, mesh.faces
    diagonal = float(np.linalg.norm(np.ptp(x, axis=0)))
    if not 0.0 < diagonal < np.inf:
        raise UserError(mesh.source, "nodes", f"the mesh is {diagonal:g} wide, expected a garment")
    edges = unique_edges(faces)
    length = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    _check_spikes(mesh, edges, length, diagonal)
    k = int(np.argmax(length))
    if length[k] > max(_LONGEST * diagonal, _LONGER * float(np.median(length))):
        raise UserError(
            mesh.source,
            "faces",
            f"an edge is {length[k]:.3g} m long in a garment with a diagonal of "
            f"{diagonal:.3g} m, from {mesh.node(edges[k, 0])} to "
            f"{mesh.node(edges[k, 1])}; half of all are below {np.median(length):.2g} m "
            f"({_CAUSES})",
        )
    areas = face_areas(x, faces)
    if areas.sum() > _LARGEST_AREA * diagonal**2:
        raise UserError(
            mesh.source,
            "faces",
            f"an area of {areas.sum():.3g} m² with a diagonal of "
            f"{diagonal:.3g} m, expected {_LARGEST_AREA * diagonal**2:.2g} "
            f"m² at most ({_CAUSES})",
        )
    flat = np.flatnonzero(areas < 1e-6 * np.mean(areas))
    if len(flat):
        raise UserError(
            mesh.source, "faces", f"{len(flat)} without area, the first is {mesh.face(flat[0])}"
        )


def _check_spikes(mesh: RawMesh, edges: IntArray, length: FloatArray, diagonal: float) -> None:
    x, faces, n = mesh.position, mesh.faces, len(mesh.position)
    shortest = np.full(n, np.inf)
    for end in edges.T:
        np.minimum.at(shortest, end, length)
    far = shortest > _FAR * diagonal
    if not far.any():
        return
    angle, across, count = np.zeros(n), np.zeros(n), np.zeros(n)
    for k in range(3):
        at, b, c = (faces[:, (k + j) % 3] for j in range(3))
        u, v = x[b] - x[at], x[c] - x[at]
        size = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
        cosine = np.clip((u * v).sum(axis=1) / np.maximum(size, 1e-300), -1.0, 1.0)
        np.add.at(angle, at, np.arccos(cosine))
        np.add.at(across, at, np.linalg.norm(u - v, axis=1))
        np.add.at(count, at, 1.0)
    across /= np.maximum(count, 1.0)
    border = np.zeros(n, dtype=bool)
    border[border_edges(faces, n)] = True
    spike = far & np.where(border, shortest > _SPIKE_RATIO * across, angle < _SPIKE_ANGLE)
    if spike.any():
        i = int(np.argmax(np.where(spike, shortest, 0.0)))
        raise UserError(
            mesh.source,
            "nodes",
            f"{mesh.node(i)} is {shortest[i]:.3g} m off its nearest neighbour, where its "
            f"neighbours are {across[i]:.2g} m apart ({_CAUSES})",
        )
