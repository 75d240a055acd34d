"""Finds pairs of node and triangle, and of edges, that may come near each other during a motion.

Pairs are found through nodes: if a node and a triangle, or two edges, are closer than d, then two
of their corners are within sqrt(d² + (ℓ_i² + ℓ_j²)/3), ℓ the longest edge at each. So one uniform
grid of nodes is searched (`meetings`), and only nodes near another layer are examined further. A
pair belongs to its two closest corners, so it is found only once. Pairs are skipped if they are too
far apart along the cloth normal at one node, or along the line between both nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.layers.closest import EDGE_EDGE, NODE_TRIANGLE, closest, offset
from drake_dress.models.cloth.layers.meetings import Meetings, squared
from drake_dress.models.cloth.layers.motion import Motion
from drake_dress.models.cloth.layers.topology import Topology


@dataclass(frozen=True)
class Passing:
    """Layers that may pass through each other.

    Attributes:
        tangled: (n,) nodes that may all pass through each other.
        astray: (n,) nodes that have passed a layer and may come back through it.
        around: (n,) nodes that contain this layer.
    """

    tangled: BoolArray
    astray: BoolArray
    around: BoolArray

    def may(self, node: IntArray) -> BoolArray:
        """Returns (P,) which pairs of nodes (P,4) may pass through each other."""
        back = self.astray[node].any(axis=1) & self.around[node].all(axis=1)
        passing: BoolArray = np.logical_or(back, self.tangled[node].all(axis=1))
        return passing


@dataclass(frozen=True)
class Pairs:
    """Pairs that may come near each other.

    Attributes:
        node: (P,4) node and triangle, or edge and edge.
        kind: (P,) NODE_TRIANGLE or EDGE_EDGE.
        weights: (P,4) of the closest points at the start.
        direction: (P,3) unit vector between them, toward the first part.
        distance: (P,) m.
    """

    node: IntArray
    kind: IntArray
    weights: FloatArray
    direction: FloatArray
    distance: FloatArray

    def without(self, passing: Passing | None) -> Pairs:
        """Returns the pairs that may not pass through each other."""
        if passing is None:
            return self
        kept = ~passing.may(self.node)
        return Pairs(*(values[kept] for values in vars(self).values()))


class PairFinder:
    """Finds pairs; keeps work space only, so that results depend on the arguments alone.

    Args:
        topology: topology of the mesh.
        edge: mean length of its edges, m.
        usual: see `Meetings`.
    """

    def __init__(self, topology: Topology, edge: float, usual: float = 0.0) -> None:
        self._t = topology
        self._meetings = Meetings(topology, edge, usual)
        self._capacity = 4 * topology.node_count + 64

    def find(self, x: FloatArray, motion: Motion, near: float) -> Pairs:
        """Returns all pairs that may come within `near`, m, when nodes at `x` move by `motion`.

        Pairs that already touch have no defined side and are left out.
        """
        t = self._t
        met = self._meetings.find(x, motion, near)
        while True:
            rows = self._capacity + 1
            pairs = Pairs(
                np.empty((rows, 4), dtype=np.int32),
                np.empty(rows, dtype=np.int32),
                np.empty((rows, 4)),
                np.empty((rows, 3)),
                np.empty(rows),
            )
            count = _pairs_at(
                x,
                motion.rest,
                motion.spread,
                near,
                met,
                t.triangle,
                t.joined_start,
                t.joined,
                t.around_start,
                t.around,
                t.ring_start,
                t.ring,
                pairs.node,
                pairs.kind,
                pairs.weights,
                pairs.direction,
                pairs.distance,
            )
            if count <= self._capacity:
                break
            self._capacity = 2 * count
        return Pairs(
            pairs.node[:count],
            pairs.kind[:count],
            pairs.weights[:count],
            pairs.direction[:count],
            pairs.distance[:count],
        )


@nb.njit(cache=True, nogil=True)
def _pairs_at(  # type: ignore[no-untyped-def]
    x,
    rest,
    spread,
    near,
    met,
    triangle,
    joined_start,
    joined,
    around_start,
    around,
    ring_start,
    ring,
    pair,
    kind,
    weights,
    direction,
    distance,
):
    n = x.shape[0]
    ring_i = np.full(n, -1, dtype=np.int32)
    ring_j = np.full(n, -1, dtype=np.int32)
    # For the neighbours of i and j: the number of the meeting if they may belong to a pair of it,
    # and how far they extend toward the other node.
    open_i = np.full(n, -1, dtype=np.int32)
    open_j = np.full(n, -1, dtype=np.int32)
    out_i = np.zeros(n)
    out_j = np.zeros(n)
    # cloth normals, and the heights of both parts of a meeting along them
    facing = _facing(x, triangle)
    height_i = np.zeros(n)
    height_j = np.zeros(n)
    count = 0
    for m in range(met.shape[0]):
        i, j = met[m, 0], met[m, 1]
        gap2 = squared(x, i, j)
        bound = near + np.sqrt(squared(rest, i, j)) + spread[i] + spread[j]
        allowed = bound * np.sqrt(gap2)
        for k in range(ring_start[i], ring_start[i + 1]):
            ring_i[ring[k]] = m
        for k in range(ring_start[j], ring_start[j + 1]):
            ring_j[ring[k]] = m
        _open(x, i, j, m, gap2, ring_j, joined_start, joined, open_i, out_i)
        _open(x, j, i, m, gap2, ring_i, joined_start, joined, open_j, out_j)
        parted = _parted(
            x, facing[j], i, j, m, joined_start, joined, open_i, open_j, height_i, height_j
        )
        if parted <= bound:
            parted = _parted(
                x, facing[i], i, j, m, joined_start, joined, open_i, open_j, height_i, height_j
            )
        if parted > bound:
            continue
        for swapped in range(2):
            p = j if swapped else i
            q = i if swapped else j
            for k in range(around_start[q], around_start[q + 1]):
                t = around[k]
                t0, t1, t2 = triangle[t, 0], triangle[t, 1], triangle[t, 2]
                belongs = True
                ahead = 0.0
                low = height_i[i] if swapped else height_j[j]
                for c in range(3):
                    node = t0 if c == 0 else (t1 if c == 1 else t2)
                    if node == q:
                        continue
                    if (open_i[node] if swapped else open_j[node]) != m:
                        belongs = False
                        break
                    ahead = max(ahead, out_i[node] if swapped else out_j[node])
                    low = max(low, height_i[node]) if swapped else min(low, height_j[node])
                parted = height_j[j] - low if swapped else low - height_i[i]
                if belongs and gap2 - ahead <= allowed and parted <= bound:
                    count = _add(
                        x, rest, near, NODE_TRIANGLE, p, t0, t1, t2,
                        pair, kind, weights, direction, distance, count,
                    )  # fmt: skip
        for ka in range(joined_start[i], joined_start[i + 1]):
            a = joined[ka]
            if open_i[a] != m:
                continue
            left = gap2 - out_i[a]
            high = max(height_i[i], height_i[a])
            for kb in range(joined_start[j], joined_start[j + 1]):
                b = joined[kb]
                if open_j[b] != m or left - out_j[b] > allowed:
                    continue
                if min(height_j[j], height_j[b]) - high > bound:
                    continue
                d2 = squared(x, a, b)
                if d2 < gap2 or (d2 == gap2 and _before(a, b, i, j)):
                    continue
                joined_ends = False
                for k in range(ring_start[a], ring_start[a + 1]):
                    joined_ends |= ring[k] == b
                if not joined_ends:
                    count = _add(
                        x, rest, near, EDGE_EDGE, i, a, j, b,
                        pair, kind, weights, direction, distance, count,
                    )  # fmt: skip
    return count


@nb.njit(cache=True, nogil=True)
def _open(  # type: ignore[no-untyped-def]
    x, i, j, m, gap2, ring_j, joined_start, joined, is_open, out
):
    """Marks the neighbours of i that are outside j's ring and not closer to j than i is."""
    for k in range(joined_start[i], joined_start[i + 1]):
        a = joined[k]
        d2 = squared(x, a, j)
        later = d2 > gap2 or (d2 == gap2 and not _before(a, j, i, j))
        is_open[a] = m if later and ring_j[a] != m else -1
        out[a] = max(0.0, _along(x, i, j, a))


@nb.njit(cache=True, nogil=True)
def _facing(x, triangle):  # type: ignore[no-untyped-def]
    """Returns (n,3) the cloth normal at each node, unit vectors, or zeros."""
    facing = np.zeros_like(x)
    for t in range(triangle.shape[0]):
        i, j, k = triangle[t, 0], triangle[t, 1], triangle[t, 2]
        a0, a1, a2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        b0, b1, b2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        n0, n1, n2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
        for c in range(3):
            node = i if c == 0 else (j if c == 1 else k)
            facing[node, 0] += n0
            facing[node, 1] += n1
            facing[node, 2] += n2
    for i in range(x.shape[0]):
        size = np.sqrt(facing[i, 0] ** 2 + facing[i, 1] ** 2 + facing[i, 2] ** 2)
        if size > 0.0:
            for c in range(3):
                facing[i, c] /= size
    return facing


@nb.njit(cache=True, nogil=True)
def _parted(  # type: ignore[no-untyped-def]
    x, facing, i, j, m, joined_start, joined, open_i, open_j, height_i, height_j
):
    """Returns the gap between i and j, each with its open neighbours, along `facing` (3,), m.

    Writes the heights of both parts, mirrored so that j's part is the upper one.
    """
    n0, n1, n2 = facing[0], facing[1], facing[2]
    high = n0 * x[i, 0] + n1 * x[i, 1] + n2 * x[i, 2]
    low = n0 * x[j, 0] + n1 * x[j, 1] + n2 * x[j, 2]
    if low < high:
        n0, n1, n2, high, low = -n0, -n1, -n2, -high, -low
    height_i[i], height_j[j] = high, low
    for k in range(joined_start[i], joined_start[i + 1]):
        a = joined[k]
        if open_i[a] == m:
            height_i[a] = n0 * x[a, 0] + n1 * x[a, 1] + n2 * x[a, 2]
            high = max(high, height_i[a])
    for k in range(joined_start[j], joined_start[j + 1]):
        b = joined[k]
        if open_j[b] == m:
            height_j[b] = n0 * x[b, 0] + n1 * x[b, 1] + n2 * x[b, 2]
            low = min(low, height_j[b])
    return low - high


@nb.njit(cache=True, nogil=True)
def _before(a, b, i, j):  # type: ignore[no-untyped-def]
    """Returns whether (a, b) comes before (i, j), to order pairs that are equally far apart."""
    return min(a, b) < min(i, j) or (min(a, b) == min(i, j) and max(a, b) < max(i, j))


@nb.njit(cache=True, nogil=True)
def _add(  # type: ignore[no-untyped-def]
    x, rest, near, which, i, j, k, l, pair, kind, weights, direction, distance, count
):
    """Adds a pair if its distance may fall below `near`; beyond the capacity it only counts.

    The arrays have one row beyond their capacity, where discarded pairs are written.
    """
    apart = max(squared(rest, i, k), squared(rest, i, l))
    if which == NODE_TRIANGLE:
        apart = max(apart, squared(rest, i, j))
    else:
        apart = max(apart, squared(rest, j, k), squared(rest, j, l))
    row = min(count, kind.shape[0] - 1)
    nodes, c = pair[row], weights[row]
    nodes[0], nodes[1], nodes[2], nodes[3] = i, j, k, l
    closest(x, which, nodes, c)
    g0, g1, g2 = offset(x, nodes, c)
    d = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
    if d > near + np.sqrt(apart) or d == 0.0:
        return count
    kind[row] = which
    direction[row, 0] = g0 / d
    direction[row, 1] = g1 / d
    direction[row, 2] = g2 / d
    distance[row] = d
    return count + 1


@nb.njit(cache=True, nogil=True)
def _along(x, i, j, k):  # type: ignore[no-untyped-def]
    """Returns (x_k − x_i)·(x_j − x_i): how far k extends from i toward j, times their distance."""
    return (
        (x[k, 0] - x[i, 0]) * (x[j, 0] - x[i, 0])
        + (x[k, 1] - x[i, 1]) * (x[j, 1] - x[i, 1])
        + (x[k, 2] - x[i, 2]) * (x[j, 2] - x[i, 2])
    )
