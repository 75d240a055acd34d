"""Neighbourhoods of nodes on the mesh, as compressed rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import IntArray
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.layers.piercing import within_rings


@dataclass(frozen=True)
class Topology:
    """Rows of nodes and triangles around each node; row i is values[start[i]:start[i + 1]].

    Attributes:
        node_count: n.
        triangle: (F,3) nodes.
        edge: (E,2) nodes.
        joined_start, joined: nodes that share an edge with a node.
        around_start, around: triangles around a node.
        ring_start, ring: nodes too close on the mesh to be another layer, itself included, sorted.
    """

    node_count: int
    triangle: IntArray
    edge: IntArray
    joined_start: IntArray
    joined: IntArray
    around_start: IntArray
    around: IntArray
    ring_start: IntArray
    ring: IntArray


def make_topology(elements: Elements, rings: int) -> Topology:
    """Returns the rows of a mesh; nodes within `rings` edges count as too close."""
    n, edge, triangle = elements.node_count, elements.edge, elements.triangle
    joined = _rows(
        np.concatenate([edge[:, 0], edge[:, 1]]), np.concatenate([edge[:, 1], edge[:, 0]]), n
    )
    faces = np.repeat(np.arange(len(triangle), dtype=np.int32), 3)
    around = _rows(triangle.ravel(), faces, n)
    reach = within_rings(elements, rings)
    start = np.concatenate([[0], np.cumsum([len(r) for r in reach])]).astype(np.int32)
    return Topology(
        n,
        np.ascontiguousarray(triangle),
        np.ascontiguousarray(edge),
        *joined,
        *around,
        start,
        np.concatenate(reach).astype(np.int32),
    )


def _rows(row: IntArray, value: IntArray, n: int) -> tuple[IntArray, IntArray]:
    order = np.lexsort((value, row))
    start = np.searchsorted(row[order], np.arange(n + 1)).astype(np.int32)
    return start, np.ascontiguousarray(value[order], dtype=np.int32)
