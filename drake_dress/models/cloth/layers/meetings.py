"""Finds nodes of different layers that may meet during a motion, reusing earlier searches.

A search of a grid of nodes leaves some room to spare. Until nodes have used it up, all nodes that
may meet are among those that it found. Every call tests each of them, in the order of their
numbers, so that the result depends on the arguments alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.layers.motion import Motion
from drake_dress.models.cloth.layers.topology import Topology

_MOST_CELLS = 400_000
# Room to spare, in mean edge lengths: for how much nearer two nodes get between searches, and for
# how much more a node moves in a later step. More room would find nodes two edges away on the same
# layer, which are not another layer.
_ROOM = 0.3
_MORE = 0.05
# The same, for rounding: all searches must find a node at the limit of the requested distance.
_ROUNDING = 1e-9
# Mean relative motion in a step, in mean edge lengths, above which room would not last.
_LARGE = 0.1


@dataclass(frozen=True)
class _Search:
    """Result of a search, and the limits within which it holds.

    Attributes:
        met: (K,2) nodes, the lower number first, in ascending order.
        x: (n,3) positions of the nodes at the search, m.
        reach: (n,) limit of a node's relative motion, m.
        longest: (n,) limit of the squared length of its edges, m².
        near: limit of the requested distance, m.
        room: limit of how much nearer two nodes get, m.
    """

    met: IntArray
    x: FloatArray
    reach: FloatArray
    longest: FloatArray
    near: float
    room: float


class Meetings:
    """Finds nodes that may meet; keeps work space only.

    Args:
        topology: topology of the mesh.
        edge: mean length of its edges, m.
        usual: distance that is often requested, m: a search for less covers it, too.
    """

    def __init__(self, topology: Topology, edge: float, usual: float = 0.0) -> None:
        self._t = topology
        self._edge = edge
        self._usual = usual
        self._most = topology.node_count + 64
        self._last: _Search | None = None

    def find(self, x: FloatArray, motion: Motion, near: float) -> IntArray:
        """Returns (M,2) nodes whose elements may come within `near`, m, outside each other's rings.

        See `neighbours` for the bound.
        """
        last = self._last
        if last is None or not self._holds(last, x, motion, near):
            last = self._last = self._search(x, motion, max(near, self._usual))
        met: IntArray = _meeting(last.met, x, motion.rest, motion.spread, motion.longest, near)
        return met

    def _holds(self, last: _Search, x: FloatArray, motion: Motion, near: float) -> bool:
        if near > last.near:
            return False
        holds: bool = _within(
            x, last.x, motion.reach, last.reach, motion.longest, last.longest, last.room
        )
        return holds

    def _search(self, x: FloatArray, motion: Motion, near: float) -> _Search:
        t = self._t
        reach, longest, room = motion.reach, motion.longest, 0.0
        if float(reach.mean()) < _LARGE * self._edge:
            reach = 2.0 * reach + _MORE * self._edge
            longest = 1.1 * longest
            room = _ROOM * self._edge
        low, extent, cell = _cells(x, reach, longest, near, room)
        while np.prod(np.floor(extent / cell) + 1.0) > _MOST_CELLS:
            cell *= 1.3
        shape = (np.floor(extent / cell) + 1.0).astype(np.int64)
        order, start = _bin(x, low, cell, shape)
        while True:
            met = np.empty(self._most + 1, dtype=np.int64)
            count = _search(
                x,
                reach,
                longest,
                near,
                room + _ROUNDING * self._edge,
                low,
                cell,
                shape,
                order,
                start,
                t.ring_start,
                t.ring,
                met,
            )
            if count <= self._most:
                break
            self._most = 2 * count
        numbers = np.sort(met[:count])
        n = t.node_count
        both = np.stack([numbers // n, numbers % n], axis=1).astype(np.int32)
        return _Search(both, x.copy(), reach, longest, near, room)


@nb.njit(cache=True, nogil=True)
def _within(x, before, reach, most_reach, longest, most_longest, room):  # type: ignore[no-untyped-def]
    """Returns whether no two nodes got nearer by more than `room`, and no limit is exceeded.

    The mean motion is subtracted, as it brings no node nearer to another.
    """
    n = x.shape[0]
    m0 = m1 = m2 = 0.0
    for i in range(n):
        if reach[i] > most_reach[i] or longest[i] > most_longest[i]:
            return False
        m0 += x[i, 0] - before[i, 0]
        m1 += x[i, 1] - before[i, 1]
        m2 += x[i, 2] - before[i, 2]
    m0, m1, m2 = m0 / n, m1 / n, m2 / n
    furthest = 0.0
    for i in range(n):
        u0 = x[i, 0] - before[i, 0] - m0
        u1 = x[i, 1] - before[i, 1] - m1
        u2 = x[i, 2] - before[i, 2] - m2
        furthest = max(furthest, u0 * u0 + u1 * u1 + u2 * u2)
    return 2.0 * np.sqrt(furthest) <= room


@nb.njit(cache=True, nogil=True)
def _meeting(among, x, rest, spread, longest, near):  # type: ignore[no-untyped-def]
    """Returns the pairs in `among` (K,2) that may meet."""
    met = np.empty_like(among)
    count = 0
    for k in range(among.shape[0]):
        i, j = among[k, 0], among[k, 1]
        gap2 = squared(x, i, j)
        bound = near + np.sqrt(squared(rest, i, j)) + spread[i] + spread[j]
        met[count, 0] = i
        met[count, 1] = j
        count += gap2 <= bound * bound + (longest[i] + longest[j]) / 3.0
    return met[:count]


@nb.njit(cache=True, nogil=True)
def _cells(x, reach, longest, near, room):  # type: ignore[no-untyped-def]
    """Returns the bounding box of all nodes, and a cell size of about the search radius."""
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
    return low, high - low, 1.3 * (np.sqrt((near + 2.0 * far) ** 2 + size / 1.5) + room)


@nb.njit(cache=True, nogil=True)
def _bin(x, low, cell, shape):  # type: ignore[no-untyped-def]
    """Returns the nodes in cell order, and where each cell begins."""
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
def _search(  # type: ignore[no-untyped-def]
    x, reach, longest, near, room, low, cell, shape, order, start, ring_start, ring, met
):
    """Writes i n + j, i < j, of nodes that may meet while the search holds.

    Beyond the capacity of `met` it only counts.
    """
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
        radius = np.sqrt((near + reach[i] + furthest) ** 2 + (longest[i] + most) / 3.0) + room
        radius2 = radius * radius
        a0 = min(int((x0 - low[0]) * inverse), shape[0] - 1)
        own = min(int((x1 - low[1]) * inverse), n1 - 1)
        b0 = int(max(x1 - radius - low[1], 0.0) * inverse)
        c0 = int(max(x2 - radius - low[2], 0.0) * inverse)
        a1 = min(int((x0 + radius - low[0]) * inverse), shape[0] - 1)
        b1 = min(int((x1 + radius - low[1]) * inverse), n1 - 1)
        c1 = min(int((x2 + radius - low[2]) * inverse), n2 - 1)
        # Only nodes after this one in cell order, so that each two meet once. The processor cannot
        # predict whether a node is near, so they are gathered without branches first.
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
            allowed = (
                np.sqrt((near + reach[i] + reach[j]) ** 2 + (longest[i] + longest[j]) / 3.0) + room
            )
            if squared(x, i, j) > allowed * allowed:
                continue
            met[min(count, met.shape[0] - 1)] = min(i, j) * np.int64(n) + max(i, j)
            count += 1
    return count


@nb.njit(cache=True, nogil=True)
def squared(x, i, j):  # type: ignore[no-untyped-def]
    """Returns the squared distance of rows `i` and `j` of `x` (n,3)."""
    return (x[i, 0] - x[j, 0]) ** 2 + (x[i, 1] - x[j, 1]) ** 2 + (x[i, 2] - x[j, 2]) ** 2
