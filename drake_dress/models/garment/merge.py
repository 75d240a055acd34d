"""Merges nodes at the same place, and sews seams whose edges lie side by side.

Files often hold one copy of a node for each panel or triangle. Nodes at the same place are always
merged. A seam with a gap is sewn where two border edges run in opposite directions and both pairs
of ends are within the distance. Single nodes that only come close, and nodes inside the cloth, stay
separate.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.garment.edges import border_edges, half_edges
from drake_dress.models.garment.files.raw import RawMesh

# Nodes nearer than this, relative to the size of the mesh, were one node before rounding.
_ROUNDING = 1e-7
# Widest gap across which a border edge is sewn, as a fraction of its own length.
_NARROW = 0.5
_CANDIDATES = 8  # partners that are tried for each border edge


def duplicates_merged(mesh: RawMesh) -> RawMesh:
    """Returns the mesh with nodes at the same place merged and unused nodes dropped."""
    place = mesh.position + 0.0  # turns -0 into 0
    _, first, which = np.unique(place, axis=0, return_index=True, return_inverse=True)
    exact = first[which.reshape(-1)]
    # the median is robust against a single wild coordinate
    spread = np.linalg.norm(place - np.median(place, axis=0), axis=1)
    radius = _ROUNDING * 2.0 * float(np.median(spread))
    pairs = first[KDTree(place[first]).query_pairs(radius, output_type="ndarray")]
    return mesh.joined(_groups(pairs, len(place))[exact])


def seams_sewn(mesh: RawMesh, distance: float) -> RawMesh:
    """Returns the mesh with border edges that lie side by side joined.

    A joined edge brings the ends of its neighbours together, so this is repeated until nothing
    more is joined.

    Args:
        mesh: without duplicate nodes.
        distance: largest distance between the ends of two edges.
    """
    while True:
        sewn = _sewn_once(mesh, distance)
        if len(sewn.position) == len(mesh.position):
            return sewn
        mesh = sewn


def _sewn_once(mesh: RawMesh, distance: float) -> RawMesh:
    x, n = mesh.position, len(mesh.position)
    border = border_edges(mesh.faces, n)
    if len(border) < 2 or distance <= 0.0:
        return mesh
    tail, head = x[border[:, 0]], x[border[:, 1]]
    reach = np.minimum(distance, _NARROW * np.linalg.norm(head - tail, axis=1))
    opposite = KDTree(np.concatenate([head, tail], axis=1))
    count = min(_CANDIDATES, len(border))
    far, other = opposite.query(
        np.concatenate([tail, head], axis=1), k=count, distance_upper_bound=2.0 * distance
    )
    partner = np.full(len(border), -1)
    adjacent = _edge_keys(mesh.faces, n)
    for k in range(count):  # the nearest first
        e = np.flatnonzero(np.isfinite(far[:, k]) & (partner < 0))
        f = other[e, k]
        gap = np.maximum(
            np.linalg.norm(tail[e] - head[f], axis=1), np.linalg.norm(head[e] - tail[f], axis=1)
        )
        good = (e != f) & (gap <= np.minimum(reach[e], reach[f]))
        # the two sides of a ribbon are not a seam: its own edges already join them
        for a, b in ((border[e, 0], border[f, 1]), (border[e, 1], border[f, 0])):
            good &= ~np.isin(_keys(a, b, n), adjacent)
        partner[e[good]] = f[good]
    chosen = np.flatnonzero(partner >= 0)
    chosen = chosen[partner[partner[chosen]] == chosen]
    if len(chosen) == 0:
        return mesh
    pairs = np.concatenate(
        [
            np.stack([border[chosen, 0], border[partner[chosen], 1]], axis=1),
            np.stack([border[chosen, 1], border[partner[chosen], 0]], axis=1),
        ]
    )
    return mesh.joined(_groups(pairs, n))


def _groups(pairs: IndexArray, n: int) -> IndexArray:
    """Returns (n,) the smallest node of the group that each node is joined to."""
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    count, label = connected_components(graph, directed=False)
    smallest = np.full(count, n, dtype=np.int64)
    np.minimum.at(smallest, label, np.arange(n))
    return smallest[label]


def _keys(a: IndexArray, b: IndexArray, n: int) -> IndexArray:
    return np.asarray(np.minimum(a, b).astype(np.int64) * n + np.maximum(a, b))


def _edge_keys(faces: IndexArray, n: int) -> IndexArray:
    half = half_edges(faces).astype(np.int64)
    return np.unique(_keys(half[:, 0], half[:, 1], n))


def gap_between(position: FloatArray, others: FloatArray) -> float:
    """Returns the smallest distance between two sets of nodes, (n,3) and (m,3)."""
    return float(KDTree(others).query(position)[0].min())
