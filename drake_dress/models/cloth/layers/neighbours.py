"""Which nodes and triangles, and which edges, may come near each other during a motion.

Pairs are found through nodes: when a node and a triangle, or two edges, are closer than d, then
two of their corners are within sqrt(d² + (ℓ_i² + ℓ_j²)/3), ℓ the longest edge at each. So one
uniform grid of nodes is searched, and only nodes that see another layer are looked at further. A
pair belongs to its two closest corners, hence it is found once.

The motion's common part costs nothing: the best-fitting twist t + ω × r is taken off first. It is
linear in r and its symmetric part is the identity, so along it no distance ever shrinks, and the
distance of a pair can shrink at most by the relative motion of what is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.cloth.elements import FloatArray, IntArray
from drake_dress.models.cloth.layers.closest import EDGE_EDGE, NODE_TRIANGLE, closest, offset
from drake_dress.models.cloth.layers.topology import Topology

_MOST_CELLS = 400_000


@dataclass(frozen=True)
class Motion:
    """A displacement without its common part.

    Attributes:
        rest: (n,3) what the best-fitting twist leaves of the displacement, m.
        spread: (n,) how far a node's neighbours depart from it at most, m.
        reach: (n,) size of `rest` and `spread` together, m.
        longest: (n,) squared length of the longest edge at a node, m².
        turn: angle of the twist, rad.
    """

    rest: FloatArray
    spread: FloatArray
    reach: FloatArray
    longest: FloatArray
    turn: float


@dataclass(frozen=True)
class Pairs:
    """Pairs that may come near each other.

    Attributes:
        node: (P,4) node and triangle, or edge and edge.
        kind: (P,) which of both.
        weights: (P,4) of the closest points at the start.
        direction: (P,3) unit vector between them, toward the first part.
        distance: (P,) m.
    """

    node: IntArray
    kind: IntArray
    weights: FloatArray
    direction: FloatArray
    distance: FloatArray


def relative_motion(topology: Topology, x: FloatArray, dx: FloatArray) -> Motion:
    """Returns the displacement `dx` (n,3), m, of nodes at `x` (n,3), m, without its twist."""
    rest = np.empty_like(x)
    n = len(x)
    reach, spread, longest = np.empty(n), np.empty(n), np.empty(n)
    turn = _take_off_twist(x, dx, rest)
    _edge_spread(x, rest, topology.edge, reach, spread, longest)
    return Motion(rest, spread, reach, longest, turn)


class PairFinder:
    """Finds pairs; keeps work space only, so that results depend on the arguments alone."""

    def __init__(self, topology: Topology) -> None:
        self._t = topology
        self._meetings = topology.node_count + 64
        self._capacity = 4 * topology.node_count + 64

    def find(self, x: FloatArray, motion: Motion, near: float) -> Pairs:
        """Returns all pairs that may come within `near`, m, when nodes at `x` move by `motion`.

        Pairs that touch already have no side to be kept on and are left out.
        """
        t = self._t
        low, extent, cell = _cells(x, motion.reach, motion.longest, near)
        while np.prod(np.floor(extent / cell) + 1.0) > _MOST_CELLS:
            cell *= 1.3
        shape = (np.floor(extent / cell) + 1.0).astype(np.int64)
        order, start = _bin(x, low, cell, shape)
        while True:
            met = np.empty((self._meetings + 1, 2), dtype=np.int32)
            count = _meetings(
                x,
                motion.rest,
                motion.reach,
                motion.spread,
                motion.longest,
                near,
                low,
                cell,
                shape,
                order,
                start,
                t.ring_start,
                t.ring,
                met,
            )
            if count <= self._meetings:
                break
            self._meetings = 2 * count
        met = met[:count]
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
def _take_off_twist(x, dx, rest):  # type: ignore[no-untyped-def]
    n = x.shape[0]
    c = np.zeros(3)
    m = np.zeros(3)
    for i in range(n):
        for k in range(3):
            c[k] += x[i, k]
            m[k] += dx[i, k]
    c /= max(n, 1)
    m /= max(n, 1)
    xx = yy = zz = xy = xz = yz = 0.0
    l0 = l1 = l2 = 0.0
    for i in range(n):
        r0, r1, r2 = x[i, 0] - c[0], x[i, 1] - c[1], x[i, 2] - c[2]
        u0, u1, u2 = dx[i, 0] - m[0], dx[i, 1] - m[1], dx[i, 2] - m[2]
        xx += r0 * r0
        yy += r1 * r1
        zz += r2 * r2
        xy += r0 * r1
        xz += r0 * r2
        yz += r1 * r2
        l0 += r1 * u2 - r2 * u1
        l1 += r2 * u0 - r0 * u2
        l2 += r0 * u1 - r1 * u0
    # A little more inertia than there is: nodes on a line have none about it.
    more = 1e-9 * (xx + yy + zz) + 1e-300
    a00, a11, a22 = yy + zz + more, xx + zz + more, xx + yy + more
    a01, a02, a12 = -xy, -xz, -yz
    k00 = a11 * a22 - a12 * a12
    k01 = a02 * a12 - a01 * a22
    k02 = a01 * a12 - a02 * a11
    k11 = a00 * a22 - a02 * a02
    k12 = a01 * a02 - a00 * a12
    k22 = a00 * a11 - a01 * a01
    determinant = a00 * k00 + a01 * k01 + a02 * k02
    w0 = (k00 * l0 + k01 * l1 + k02 * l2) / determinant
    w1 = (k01 * l0 + k11 * l1 + k12 * l2) / determinant
    w2 = (k02 * l0 + k12 * l1 + k22 * l2) / determinant
    for i in range(n):
        r0, r1, r2 = x[i, 0] - c[0], x[i, 1] - c[1], x[i, 2] - c[2]
        rest[i, 0] = dx[i, 0] - m[0] - (w1 * r2 - w2 * r1)
        rest[i, 1] = dx[i, 1] - m[1] - (w2 * r0 - w0 * r2)
        rest[i, 2] = dx[i, 2] - m[2] - (w0 * r1 - w1 * r0)
    return np.sqrt(w0 * w0 + w1 * w1 + w2 * w2)


@nb.njit(cache=True, nogil=True)
def _edge_spread(x, rest, edge, reach, spread, longest):  # type: ignore[no-untyped-def]
    spread[:] = 0.0
    longest[:] = 0.0
    for k in range(edge.shape[0]):
        i, j = edge[k, 0], edge[k, 1]
        size = 0.0
        apart = 0.0
        for m in range(3):
            size += (x[i, m] - x[j, m]) ** 2
            apart += (rest[i, m] - rest[j, m]) ** 2
        longest[i] = max(longest[i], size)
        longest[j] = max(longest[j], size)
        spread[i] = max(spread[i], apart)
        spread[j] = max(spread[j], apart)
    for i in range(x.shape[0]):
        spread[i] = np.sqrt(spread[i])
        reach[i] = spread[i] + np.sqrt(rest[i, 0] ** 2 + rest[i, 1] ** 2 + rest[i, 2] ** 2)


@nb.njit(cache=True, nogil=True)
def _cells(x, reach, longest, near):  # type: ignore[no-untyped-def]
    """Returns the box of all nodes and a size of cells: about the radius that is searched."""
    low = np.full(3, np.inf)
    high = np.full(3, -np.inf)
    far, size = 0.0, 0.0
    for i in range(x.shape[0]):
        far += reach[i]
        size += longest[i]
        for m in range(3):
            low[m] = min(low[m], x[i, m])
            high[m] = max(high[m], x[i, m])
    far /= x.shape[0]
    size /= x.shape[0]
    return low, high - low, 1.3 * np.sqrt((near + 2.0 * far) ** 2 + size / 1.5)


@nb.njit(cache=True, nogil=True)
def _bin(x, low, cell, shape):  # type: ignore[no-untyped-def]
    """Returns the nodes in order of cells, and where each cell begins."""
    n = x.shape[0]
    n1, n2 = shape[1], shape[2]
    where = np.empty(n, dtype=np.int64)
    start = np.zeros(shape[0] * n1 * n2 + 1, dtype=np.int32)
    inverse = 1.0 / cell
    for i in range(n):
        a = min(int((x[i, 0] - low[0]) * inverse), shape[0] - 1)
        b = min(int((x[i, 1] - low[1]) * inverse), n1 - 1)
        c = min(int((x[i, 2] - low[2]) * inverse), n2 - 1)
        where[i] = (a * n1 + b) * n2 + c
        start[where[i] + 1] += 1
    for k in range(1, start.shape[0]):
        start[k] += start[k - 1]
    filled = start[:-1].copy()
    order = np.empty(n, dtype=np.int32)
    for i in range(n):
        order[filled[where[i]]] = i
        filled[where[i]] += 1
    return order, start


@nb.njit(cache=True, nogil=True)
def _meetings(  # type: ignore[no-untyped-def]
    x, rest, reach, spread, longest, near, low, cell, shape, order, start, ring_start, ring, met
):
    """Writes the nodes that may meet, beyond each other's rings; beyond its room it only counts."""
    n = x.shape[0]
    n1, n2 = shape[1], shape[2]
    sorted_x = np.empty((n, 3))
    for s in range(n):
        for m in range(3):
            sorted_x[s, m] = x[order[s], m]
    most, furthest = 0.0, 0.0
    for i in range(n):
        most = max(most, longest[i])
        furthest = max(furthest, reach[i])
    stamp = np.full(n, -1, dtype=np.int32)
    seen = np.empty(n + 1, dtype=np.int32)
    inverse = 1.0 / cell
    count = 0
    for s in range(n):
        i = order[s]
        x0, x1, x2 = sorted_x[s, 0], sorted_x[s, 1], sorted_x[s, 2]
        radius2 = (near + reach[i] + furthest) ** 2 + (longest[i] + most) / 3.0
        radius = np.sqrt(radius2)
        a0 = min(int((x0 - low[0]) * inverse), shape[0] - 1)
        own = min(int((x1 - low[1]) * inverse), n1 - 1)
        b0 = int(max(x1 - radius - low[1], 0.0) * inverse)
        c0 = int(max(x2 - radius - low[2], 0.0) * inverse)
        a1 = min(int((x0 + radius - low[0]) * inverse), shape[0] - 1)
        b1 = min(int((x1 + radius - low[1]) * inverse), n1 - 1)
        c1 = min(int((x2 + radius - low[2]) * inverse), n2 - 1)
        # Only nodes behind this one in the order of cells: each two meet once. Whether a node is
        # near is a coin toss to the processor, so they are gathered without branches first.
        gathered = 0
        for a in range(a0, a1 + 1):
            for b in range(own if a == a0 else b0, b1 + 1):
                row = (a * n1 + b) * n2
                begin = s + 1 if a == a0 and b == own else start[row + c0]
                for q in range(begin, start[row + c1 + 1]):
                    g0 = sorted_x[q, 0] - x0
                    g1 = sorted_x[q, 1] - x1
                    g2 = sorted_x[q, 2] - x2
                    seen[gathered] = q
                    gathered += g0 * g0 + g1 * g1 + g2 * g2 <= radius2
        if gathered == 0:
            continue
        for k in range(ring_start[i], ring_start[i + 1]):
            stamp[ring[k]] = i
        kept = 0
        for g in range(gathered):
            j = order[seen[g]]
            seen[kept] = j
            kept += stamp[j] != i
        for g in range(kept):
            j = seen[g]
            gap2 = _squared(x, i, j)
            bound = near + np.sqrt(_squared(rest, i, j)) + spread[i] + spread[j]
            if gap2 > bound * bound + (longest[i] + longest[j]) / 3.0:
                continue
            row = min(count, met.shape[0] - 1)
            met[row, 0] = i
            met[row, 1] = j
            count += 1
    return count


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
    # Of the neighbours of i and j: whether they may belong to a pair of this meeting (its number
    # if so), and how far they stand out toward the other node.
    open_i = np.full(n, -1, dtype=np.int32)
    open_j = np.full(n, -1, dtype=np.int32)
    out_i = np.zeros(n)
    out_j = np.zeros(n)
    count = 0
    for m in range(met.shape[0]):
        i, j = met[m, 0], met[m, 1]
        gap2 = _squared(x, i, j)
        bound = near + np.sqrt(_squared(rest, i, j)) + spread[i] + spread[j]
        allowed = bound * np.sqrt(gap2)
        for k in range(ring_start[i], ring_start[i + 1]):
            ring_i[ring[k]] = m
        for k in range(ring_start[j], ring_start[j + 1]):
            ring_j[ring[k]] = m
        _open(x, i, j, m, gap2, ring_j, joined_start, joined, open_i, out_i)
        _open(x, j, i, m, gap2, ring_i, joined_start, joined, open_j, out_j)
        for swapped in range(2):
            p = j if swapped else i
            q = i if swapped else j
            for k in range(around_start[q], around_start[q + 1]):
                t = around[k]
                t0, t1, t2 = triangle[t, 0], triangle[t, 1], triangle[t, 2]
                belongs = True
                ahead = 0.0
                for c in range(3):
                    node = t0 if c == 0 else (t1 if c == 1 else t2)
                    if node == q:
                        continue
                    if (open_i[node] if swapped else open_j[node]) != m:
                        belongs = False
                        break
                    ahead = max(ahead, out_i[node] if swapped else out_j[node])
                if belongs and gap2 - ahead <= allowed:
                    count = _add(
                        x, rest, near, NODE_TRIANGLE, p, t0, t1, t2,
                        pair, kind, weights, direction, distance, count,
                    )  # fmt: skip
        for ka in range(joined_start[i], joined_start[i + 1]):
            a = joined[ka]
            if open_i[a] != m:
                continue
            left = gap2 - out_i[a]
            for kb in range(joined_start[j], joined_start[j + 1]):
                b = joined[kb]
                if open_j[b] != m or left - out_j[b] > allowed:
                    continue
                d2 = _squared(x, a, b)
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
    """Marks the neighbours of i that are beyond j's ring and not closer to j than i is."""
    for k in range(joined_start[i], joined_start[i + 1]):
        a = joined[k]
        d2 = _squared(x, a, j)
        later = d2 > gap2 or (d2 == gap2 and not _before(a, j, i, j))
        is_open[a] = m if later and ring_j[a] != m else -1
        out[a] = max(0.0, _along(x, i, j, a))


@nb.njit(cache=True, nogil=True)
def _before(a, b, i, j):  # type: ignore[no-untyped-def]
    """An order of pairs of nodes, for those that are equally far apart."""
    return min(a, b) < min(i, j) or (min(a, b) == min(i, j) and max(a, b) < max(i, j))


@nb.njit(cache=True, nogil=True)
def _add(  # type: ignore[no-untyped-def]
    x, rest, near, which, i, j, k, l, pair, kind, weights, direction, distance, count
):
    """Adds a pair if its distance may fall below `near`; beyond the capacity it only counts.

    The arrays have one row more than their capacity, where what is not kept is written.
    """
    apart = max(_squared(rest, i, k), _squared(rest, i, l))
    if which == NODE_TRIANGLE:
        apart = max(apart, _squared(rest, i, j))
    else:
        apart = max(apart, _squared(rest, j, k), _squared(rest, j, l))
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
def _squared(x, i, j):  # type: ignore[no-untyped-def]
    return (x[i, 0] - x[j, 0]) ** 2 + (x[i, 1] - x[j, 1]) ** 2 + (x[i, 2] - x[j, 2]) ** 2


@nb.njit(cache=True, nogil=True)
def _along(x, i, j, k):  # type: ignore[no-untyped-def]
    """Returns (x_k − x_i)·(x_j − x_i): how far k stands out from i toward j, by their distance."""
    return (
        (x[k, 0] - x[i, 0]) * (x[j, 0] - x[i, 0])
        + (x[k, 1] - x[i, 1]) * (x[j, 1] - x[i, 1])
        + (x[k, 2] - x[i, 2]) * (x[j, 2] - x[i, 2])
    )
