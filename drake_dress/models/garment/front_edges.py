"""Keeps a front open whose two edges lie on each other, such as a closed zip.

Merging nodes at the same place would sew the front, and an open coat would silently become a
pullover. Seams between panels look the same in a file. A seam is taken for the edges of an open
front if it runs from the neck to the hem along the middle of the front, where seams are rare. At
the back, where many coats have a seam, it must also be the only one of the file.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from drake_dress.models.arrays import BoolArray, IndexArray, IntArray
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.fans import HalfEdges, split_fans
from drake_dress.models.garment.files.raw import RawMesh
from drake_dress.models.garment.front import Opening, front_of
from drake_dress.models.garment.mesh import GarmentMesh

# Largest distance of the edges from the middle, m: those of double-breasted coats are 0.1 m off.
_ASIDE = 0.12
_NEAR = 0.02  # distance from the middle at which a seam counts twice its length, m
_LEVEL = 0.04  # height of the layers in which front and back are told apart, m
# Share of edges that were sewn above which a file has its own nodes for each triangle, as STL has,
# and tells nothing of seams.
_SOUP = 0.5
# Share of all sewn edges that the edges of an open back must have.
_ALONE = 0.8


class Parted(NamedTuple):
    """A garment whose front was sewn by merging, with its edges apart again.

    Attributes:
        opening: where it opens.
        copied: (k,) nodes of which second copies follow the nodes of the garment.
        faces: (F,3).
        line: nodes of one edge, from the neck down.
    """

    opening: Opening
    copied: IndexArray
    faces: IntArray
    line: IndexArray


def sewn_edges(before: RawMesh, after: RawMesh) -> IndexArray:
    """Returns (k,2) edges of a mesh that are borders of different sheets in the file.

    Args:
        before: the mesh of the file, with none of its nodes merged.
        after: with nodes merged. Empty if the file does not tell seams from other edges.
    """
    edges = HalfEdges.of(before.faces, len(before.position))
    border = after.became[before.file_node[edges.ends[edges.count == 1]]]
    border = border[(border >= 0).all(axis=1) & (border[:, 0] != border[:, 1])]
    merged = HalfEdges.of(after.faces, len(after.position))
    inner = merged.ends[merged.count == 2]
    n = len(after.position)
    key, count = np.unique(np.sort(border, axis=1) @ np.array([n, 1]), return_counts=True)
    sewn = inner[np.isin(inner @ np.array([n, 1]), key[count > 1])]
    return sewn if len(sewn) < _SOUP * len(inner) else sewn[:0]


def front_parted(mesh: GarmentMesh, sewn: IndexArray) -> Parted | None:
    """Returns a closed garment with the edges of its front, or back, apart; None without such.

    Args:
        mesh: the garment.
        sewn: (k,2) edges at which sheets were joined, of `mesh`.
    """
    if len(sewn) == 0 or front_of(mesh) != "closed":
        return None
    for opening, is_front in (("front", True), ("back", False)):
        line = _line(mesh, sewn[_beside_middle(mesh, is_front)[sewn].all(axis=1)])
        if line is None or (opening == "back" and len(line) - 1 < _ALONE * len(sewn)):
            continue
        parted = _along(mesh, line)
        x = np.concatenate([mesh.rest_position, mesh.rest_position[parted.copied]])
        if front_of(replace(mesh, rest_position=x, faces=parted.faces)) == opening:
            return parted._replace(opening=opening)
    return None


def _beside_middle(mesh: GarmentMesh, is_front: bool) -> BoolArray:
    """Returns (n,) which nodes are near the middle of the front, or of the back."""
    x = mesh.rest_position
    near = (np.abs(x[:, 1]) < _ASIDE) & (mesh.region == 0)
    level = np.floor(x[:, 2] / _LEVEL).astype(np.int64)
    level -= level.min()
    low, high = (np.full(level.max() + 1, start) for start in (np.inf, -np.inf))
    np.minimum.at(low, level[near], x[near, 0])
    np.maximum.at(high, level[near], x[near, 0])
    ahead = x[:, 0] - (0.5 * (low + high))[level]
    return np.asarray(near & (ahead > 0.0 if is_front else ahead < 0.0))


def _line(mesh: GarmentMesh, edges: IndexArray) -> IndexArray | None:
    """Returns the nodes of a line of edges from neck to hem, as near to the middle as can be."""
    x, n = mesh.rest_position, len(mesh.rest_position)
    cuffs = np.concatenate([mesh.loops["left_cuff"], mesh.loops["right_cuff"]])
    borders = [loop for loop in boundary_loops(mesh.faces) if not np.isin(loop, cuffs).any()]
    if len(borders) < 2:
        return None
    hem = min(borders, key=lambda loop: float(x[loop, 2].mean()))
    neck = max(borders, key=lambda loop: float(x[loop, 2].mean()))
    length = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    weight = length * (1.0 + (x[edges, 1].mean(axis=1) / _NEAR) ** 2)
    graph = csr_array((weight, (edges[:, 0], edges[:, 1])), shape=(n, n))
    way, before, _ = dijkstra(
        graph, directed=False, indices=neck, min_only=True, return_predecessors=True
    )
    end = int(hem[np.argmin(way[hem])])
    if not np.isfinite(way[end]):
        return None
    line = [end]
    while before[line[-1]] >= 0:
        line.append(int(before[line[-1]]))
    return np.array(line[::-1])


def _along(mesh: GarmentMesh, line: IndexArray) -> Parted:
    """Returns the mesh cut along a line of edges between two borders."""
    n = len(mesh.rest_position)
    raw = RawMesh.of("", mesh.rest_position, mesh.faces.astype(np.int64))
    edges = HalfEdges.of(raw.faces, n)
    steps = np.sort(np.stack([line[:-1], line[1:]], axis=1), axis=1) @ np.array([n, 1])
    pairs = edges.pairs()
    own = edges.ends[edges.edge[pairs[:, 0]]] @ np.array([n, 1])
    cut = split_fans(raw, edges, pairs[~np.isin(own, steps)])
    return Parted("front", cut.file_node[n:], cut.faces.astype(np.int32), line)
