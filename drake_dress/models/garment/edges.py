"""Edges, boundaries and connected components of a triangle mesh."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from drake_dress.errors import UserError
from drake_dress.models.arrays import IndexArray, IntArray


def unique_edges(faces: npt.NDArray[np.integer]) -> IntArray:
    """Returns (E,2) node indices of every edge once, the smaller first, in lexical order."""
    n = int(faces.max()) + 1
    key = np.sort(np.sort(half_edges(faces).astype(np.int64), axis=1) @ np.array([n, 1]))
    key = key[np.concatenate([[True], key[1:] > key[:-1]])]  # np.unique hashes: three times slower
    return np.stack([key // n, key % n], axis=1).astype(np.int32)


def border_edges(faces: npt.NDArray[np.integer], n: int) -> IndexArray:
    """Returns (b,2) boundary half-edges: those without an opposite half-edge.

    Args:
        faces: (F,3) node indices.
        n: number of nodes.
    """
    half = half_edges(faces).astype(np.int64)
    inner = np.isin(half[:, 0] * n + half[:, 1], half[:, 1] * n + half[:, 0])
    return np.asarray(half[~inner])


def half_edges(faces: npt.NDArray[np.integer]) -> npt.NDArray[np.integer]:
    """Returns (3F,2) half-edges of all faces, in the orientation of their faces."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def components(faces: npt.NDArray[np.integer], n: int) -> IntArray:
    """Returns (n,) the index of each node's connected component, from 0."""
    half = half_edges(faces)
    graph = coo_array((np.ones(len(half)), (half[:, 0], half[:, 1])), shape=(n, n))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int32)


def boundary_loops(faces: npt.NDArray[np.integer]) -> list[IntArray]:
    """Returns each boundary as node indices in order, the longest first.

    The order follows the faces' half-edges: the garment lies to the left of the walk. Each loop
    begins at its smallest index.

    Args:
        faces: (F,3) node indices of a manifold.

    Raises:
        UserError: boundaries meet at a node and cannot be separated, or a boundary is not closed.
    """
    border = border_edges(faces, int(faces.max()) + 1)
    if len(np.unique(border[:, 0])) < len(border):
        raise UserError("mesh", "faces", "boundaries meet in a node (the mesh is not manifold)")
    following = dict(zip(border[:, 0].tolist(), border[:, 1].tolist(), strict=True))
    loops: list[IntArray] = []
    while following:
        start = min(following)
        loop = [start]
        node = following.pop(start)
        while node != start:
            loop.append(node)
            if node not in following:
                raise UserError("mesh", "faces", f"the boundary ends at node {node}")
            node = following.pop(node)
        loops.append(np.array(loop, dtype=np.int32))
    return sorted(loops, key=lambda loop: (-len(loop), int(loop[0])))
