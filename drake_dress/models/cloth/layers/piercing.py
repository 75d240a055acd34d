"""Finds where a garment passes through itself, by a test independent of layer separation."""

from __future__ import annotations

from collections.abc import Sequence

import numba as nb
import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements


def piercing_edges(x: FloatArray, elements: Elements, rings: int = 0) -> IntArray:
    """Returns (k,2) the pairs (edge, triangle) in which the edge pierces the triangle.

    Args:
        x: (n,3) positions, m.
        elements: the mesh; edges that share a node with a triangle are left out.
        rings: also leaves out edges with a node that this many edges or fewer connect to one of the
            triangle's.
    """
    e = elements
    found = piercings(x, e.edge, e.triangle)
    if rings > 0 and len(found):
        found = found[told_apart(found, elements, within_rings(elements, rings))]
    return found


def piercings(x: FloatArray, edge: IntArray, triangle: IntArray) -> IntArray:
    """Returns (k,2) rows of edges (E,2) and of the triangles (F,3) that they pierce.

    Args:
        x: (n,3) positions, m.
        edge: (E,2) nodes; those that share a node with a triangle do not count.
        triangle: (F,3) nodes.
    """
    position = np.ascontiguousarray(x, dtype=np.float64)
    if not (len(edge) and len(triangle)):
        return np.empty((0, 2), dtype=np.int32)
    corner = position[triangle]
    axis = int(np.argmax(position.max(axis=0) - position.min(axis=0)))
    low = corner.min(axis=1)
    order = np.argsort(low[:, axis], kind="stable")
    longest = float((corner.max(axis=1) - low)[:, axis].max())
    found: IntArray = _pierced(position, edge, triangle[order], low[order, axis], axis, longest)
    found[:, 1] = order[found[:, 1]]
    return found


def told_apart(found: IntArray, elements: Elements, reach: Sequence[IntArray]) -> BoolArray:
    """Returns (k,) which (edge, triangle) in (k,2) are no neighbours; `reach` of `within_rings`."""
    edge, triangle = elements.edge, elements.triangle
    apart = [
        not any(np.isin(reach[int(node)], triangle[t]).any() for node in edge[k]) for k, t in found
    ]
    return np.array(apart, dtype=np.bool_)


def within_rings(elements: Elements, rings: int) -> list[IntArray]:
    """Returns for each node the sorted nodes at most `rings` edges away, itself included."""
    n = elements.node_count
    adjacent: list[list[int]] = [[] for _ in range(n)]
    for a, b in elements.edge.tolist():
        adjacent[a].append(b)
        adjacent[b].append(a)
    reach = []
    for node in range(n):
        seen = {node}
        front = {node}
        for _ in range(rings):
            front = {k for f in front for k in adjacent[f]} - seen
            seen |= front
        reach.append(np.array(sorted(seen), dtype=np.int32))
    return reach


@nb.njit(cache=True, nogil=True)
def _pierced(x, edge, triangle, low, axis, longest):  # type: ignore[no-untyped-def]
    found = []
    for k in range(edge.shape[0]):
        p, q = edge[k, 0], edge[k, 1]
        begin = min(x[p, axis], x[q, axis])
        end = max(x[p, axis], x[q, axis])
        first = np.searchsorted(low, begin - longest)
        for t in range(first, triangle.shape[0]):
            if low[t] > end:
                break
            a, b, c = triangle[t, 0], triangle[t, 1], triangle[t, 2]
            if p == a or p == b or p == c or q == a or q == b or q == c:
                continue
            apart = False
            for m in range(3):
                high = max(x[a, m], x[b, m], x[c, m])
                least = min(x[a, m], x[b, m], x[c, m])
                if min(x[p, m], x[q, m]) > high or max(x[p, m], x[q, m]) < least:
                    apart = True
            if not apart and _pierces(x[p], x[q], x[a], x[b], x[c]):
                found.append((k, t))
    pairs = np.empty((len(found), 2), dtype=np.int32)
    for i in range(len(found)):
        pairs[i, 0], pairs[i, 1] = found[i]
    return pairs


@nb.njit(cache=True, nogil=True)
def _pierces(p, q, a, b, c):  # type: ignore[no-untyped-def]
    """Returns whether the ends lie on both sides and the edge's line passes between all sides."""
    if _volume(a, b, c, p) * _volume(a, b, c, q) >= 0.0:
        return False
    first = _volume(p, q, a, b)
    second = _volume(p, q, b, c)
    third = _volume(p, q, c, a)
    return (first > 0.0 and second > 0.0 and third > 0.0) or (
        first < 0.0 and second < 0.0 and third < 0.0
    )


@nb.njit(cache=True, nogil=True)
def _volume(a, b, c, d):  # type: ignore[no-untyped-def]
    u0, u1, u2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    v0, v1, v2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    w0, w1, w2 = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    return w0 * (u1 * v2 - u2 * v1) + w1 * (u2 * v0 - u0 * v2) + w2 * (u0 * v1 - u1 * v0)
