"""Splits the nodes of a surface so that chosen edges come apart."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drake_dress.models.arrays import BoolArray, IndexArray
from drake_dress.models.garment.edges import half_edges
from drake_dress.models.garment.files.raw import RawMesh


@dataclass(frozen=True)
class HalfEdges:
    """Half-edges, ordered so that those of one edge are neighbours.

    Attributes:
        ends: (E,2) nodes of each edge, the smaller first.
        count: (E,) number of faces.
        edge: (3F,) edge of each half-edge.
        face: (3F,) face of each half-edge.
        forward: (3F,) whether it runs from the smaller to the larger node.
        start: (E,) first half-edge of each edge.
    """

    ends: IndexArray
    count: IndexArray
    edge: IndexArray
    face: IndexArray
    forward: BoolArray
    start: IndexArray

    @staticmethod
    def of(faces: IndexArray, n: int) -> HalfEdges:
        """Returns the half-edges of (F,3) faces on n nodes."""
        half = half_edges(faces).astype(np.int64)
        low, high = half.min(axis=1), half.max(axis=1)
        order = np.argsort(low * n + high, kind="stable")
        key, start, edge, count = np.unique(
            (low * n + high)[order], return_index=True, return_inverse=True, return_counts=True
        )
        return HalfEdges(
            np.stack([key // n, key % n], axis=1),
            count,
            edge.reshape(-1),
            np.tile(np.arange(len(faces)), 3)[order],
            (half[:, 0] < half[:, 1])[order],
            start,
        )

    def pairs(self) -> IndexArray:
        """Returns (p,2) the half-edges of each edge of two faces."""
        first = self.start[self.count == 2]
        return np.stack([first, first + 1], axis=1)


def split_fans(mesh: RawMesh, edges: HalfEdges, joined: IndexArray) -> RawMesh:
    """Returns the mesh with a node for each fan of faces that pairs (p,2) of half-edges join."""
    count, n = len(mesh.faces), len(mesh.position)
    rows: list[IndexArray] = []
    columns: list[IndexArray] = []
    for end in (0, 1):
        node = edges.ends[edges.edge[joined[:, 0]], end]
        for side, target in ((0, rows), (1, columns)):
            face = edges.face[joined[:, side]]
            corner = np.argmax(mesh.faces[face] == node[:, None], axis=1)
            target.append(3 * face + corner)
    at, to = np.concatenate(rows), np.concatenate(columns)
    graph = coo_array((np.ones(len(at)), (at, to)), shape=(3 * count, 3 * count))
    _, fan = connected_components(graph, directed=False)
    # the fan with most faces keeps its node, the others get new ones
    fans, faces_of = np.unique(fan, return_counts=True)
    node_of = np.empty(len(fans), dtype=np.int64)
    node_of[fan] = mesh.faces.reshape(-1)
    order = np.lexsort((-faces_of, node_of))
    first = np.ones(len(fans), dtype=bool)
    first[1:] = node_of[order][1:] != node_of[order][:-1]
    extra = order[~first]
    name = node_of.copy()
    name[extra] = n + np.arange(len(extra))
    return replace(
        mesh,
        position=np.concatenate([mesh.position, mesh.position[node_of[extra]]]),
        faces=name[fan].reshape(-1, 3),
        file_node=np.concatenate([mesh.file_node, mesh.file_node[node_of[extra]]]),
    )
