"""Merges the nodes of a mesh that are too close to each other.

Edges are collapsed shortest first, and only where the mesh stays manifold (the nodes' common
neighbours are exactly those of the edge's faces) and no face flips. Clustering nodes by grid cells
would be simpler, but it tears or pinches sleeves and seams.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from math import dist, hypot, sqrt

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.edges import boundary_loops, unique_edges
from drake_dress.models.garment.mesh import face_areas

LONGEST = 1.5  # longest edge that a merge may make, over the spacing
_SHORTEST = 0.75  # edges below this times the spacing merge: the mean comes near the spacing
_LEAST_LOOP = 8  # nodes that a loop keeps at least
# Cosine of the largest angle by which a face may turn, and the lowest shape quality of a face:
# twice its area over its longest side squared, 0.87 for an equilateral triangle, 0 for a needle.
_LEAST_COSINE = 0.3
_LEAST_SHAPE = 0.15
_TOLD_EVERY = 2000  # steps between reports of progress

Point = tuple[float, float, float]


def coarsen(
    position: FloatArray,
    faces: IntArray,
    loops: Sequence[IntArray],
    spacing: float,
    progress: Callable[[float], None] = lambda _: None,
) -> tuple[FloatArray, IntArray, IntArray]:
    """Returns positions, faces, and the new index of each old node.

    Two nodes of a loop or boundary merge only if they are neighbours along it. Where the mesh was
    finer, its mean edge comes near `spacing`; elsewhere the mesh stays as it is.

    Args:
        position: (n,3), m.
        faces: (F,3) of an oriented manifold.
        loops: closed chains of edges to keep, as node indices.
        spacing: wanted mean edge length, m.
        progress: called from time to time with the fraction that is done.
    """
    return _Merging(position, faces, loops, spacing).run(progress)


class _Merging:
    """State of a run of edge collapses.

    It is plain Python: a step touches some ten faces, for which calls of numpy cost more than the
    arithmetic.
    """

    def __init__(
        self, position: FloatArray, faces: IntArray, loops: Sequence[IntArray], spacing: float
    ) -> None:
        self.x: list[Point] = [(x, y, z) for x, y, z in position.tolist()]
        self.face: list[tuple[int, int, int] | None] = [(a, b, c) for a, b, c in faces.tolist()]
        self.spacing = spacing
        self.area = float(face_areas(position, faces).sum())
        self.parent = list(range(len(position)))
        self.around: list[set[int]] = [set() for _ in range(len(position))]
        for f, triangle in enumerate(faces.tolist()):
            for node in triangle:
                self.around[node].add(f)
        # each kept chain is a graph of its own: the neighbours of each node along it
        self.chain: list[dict[int, set[int]]] = []
        for loop in [*boundary_loops(faces), *loops]:
            order = loop.tolist()
            self.chain.append(
                {q: {order[i - 1], order[(i + 1) % len(order)]} for i, q in enumerate(order)}
            )
        self.queue: list[tuple[float, int, int]] = []
        for a, b in unique_edges(faces).tolist():
            self._propose(a, b)

    def run(self, progress: Callable[[float], None]) -> tuple[FloatArray, IntArray, IntArray]:
        heapq.heapify(self.queue)
        steps, merged = 0, 0
        # about all nodes beyond one per cell of a lattice at the spacing are merged
        expected = len(self.x) - self.area / (sqrt(0.75) * self.spacing**2)
        while self.queue:
            steps += 1
            if steps % _TOLD_EVERY == 0:
                progress(min(merged / max(expected, 1.0), 1.0))
            length, a, b = heapq.heappop(self.queue)
            if self.parent[a] != a or self.parent[b] != b:
                continue
            if length != dist(self.x[a], self.x[b]):
                continue  # a node has moved since; the edge is in the queue again
            if self._merge(a, b):
                merged += 1
                for other in self._neighbours(a):
                    self._propose(a, other, push=True)
        return self._result()

    def _propose(self, a: int, b: int, push: bool = False) -> None:
        length = dist(self.x[a], self.x[b])
        if length < _SHORTEST * self.spacing:
            if push:
                heapq.heappush(self.queue, (length, a, b))
            else:
                self.queue.append((length, a, b))

    def _merge(self, a: int, b: int) -> bool:
        """Merges b into a if that is allowed, and returns whether it did."""
        target = self._target(a, b)
        if target is None:
            return False
        shared = self.around[a] & self.around[b]
        common = self._neighbours(a) & self._neighbours(b)
        if len(common) != len(shared) or not shared:
            return False
        others = (self.around[a] | self.around[b]) - shared
        if not others or not all(self._stays_sound(f, a, b, target) for f in others):
            return False
        self.x[a] = target
        self.parent[b] = a
        for f in shared:
            for node in self.face[f] or ():
                self.around[node].discard(f)
            self.face[f] = None
        for f in self.around[b]:
            p, q, r = self._corners(f)
            self.face[f] = (a if p == b else p, a if q == b else q, a if r == b else r)
            self.around[a].add(f)
        for chain in self.chain:
            if b in chain:
                beside = chain.pop(b)
                chain[a] = (chain.get(a, set()) | beside) - {a, b}
                for node in beside - {a}:
                    chain[node] = (chain[node] - {b}) | {a}
        return True

    def _target(self, a: int, b: int) -> Point | None:
        """Returns the merged node's place, on a chain if one lies on it; None if not allowed."""
        on_a = [chain for chain in self.chain if a in chain]
        on_b = [chain for chain in self.chain if b in chain]
        for chain in on_a:
            if b in chain and (b not in chain[a] or len(chain) <= _LEAST_LOOP):
                return None
        if not on_a and not on_b:
            (ax, ay, az), (bx, by, bz) = self.x[a], self.x[b]
            return (0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz))
        if not on_b:
            return self.x[a]
        if not on_a:
            return self.x[b]
        if any(p is not q for p, q in zip(on_a, on_b, strict=False)) or len(on_a) != len(on_b):
            return None  # different chains, or a crossing of two
        # keep the sharper corner of the chain in place: midpoints would shrink every girth
        keep_a = all(self._loss(chain, a) >= self._loss(chain, b) for chain in on_a)
        return self.x[a if keep_a else b]

    def _loss(self, chain: dict[int, set[int]], node: int) -> float:
        """Returns the length that a chain loses without a node, m."""
        before, after = (self.x[q] for q in chain[node])
        return dist(self.x[node], before) + dist(after, self.x[node]) - dist(after, before)

    def _stays_sound(self, f: int, a: int, b: int, target: Point) -> bool:
        """Returns whether face f keeps its side, shape and edge bound with a or b at the target."""
        corners = self._corners(f)
        k = 0 if corners[0] in (a, b) else 1 if corners[1] in (a, b) else 2
        # the corner that moves comes first, then the two others in the face's orientation
        old, p, q = (self.x[corners[(k + j) % 3]] for j in range(3))
        to_p, to_q, side = dist(target, p), dist(target, q), dist(p, q)
        if max(to_p, to_q) > LONGEST * self.spacing:
            return False
        sx, sy, sz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        before, after = _across(old, p, sx, sy, sz), _across(target, p, sx, sy, sz)
        size = hypot(*after)
        along = before[0] * after[0] + before[1] * after[1] + before[2] * after[2]
        if along < _LEAST_COSINE * hypot(*before) * size:
            return False
        return size > _LEAST_SHAPE * max(to_p, to_q, side) ** 2

    def _corners(self, f: int) -> tuple[int, int, int]:
        corners = self.face[f]
        assert corners is not None, "a node is beside a face that is gone"
        return corners

    def _neighbours(self, node: int) -> set[int]:
        found: set[int] = set()
        for f in self.around[node]:
            found.update(self._corners(f))
        found.discard(node)
        return found

    def _result(self) -> tuple[FloatArray, IntArray, IntArray]:
        root = np.array([self._root(node) for node in range(len(self.parent))])
        kept = np.unique(root)
        faces = np.array([f for f in self.face if f is not None], dtype=np.int64)
        return (
            np.array(self.x, dtype=np.float64)[kept],
            np.searchsorted(kept, faces).astype(np.int32),
            np.searchsorted(kept, root).astype(np.int32),
        )

    def _root(self, node: int) -> int:
        while self.parent[node] != node:
            node = self.parent[node]
        return node


def _across(corner: Point, p: Point, sx: float, sy: float, sz: float) -> tuple[float, float, float]:
    """Returns twice the vector area of the triangle of a corner and the side s that begins at p."""
    ux, uy, uz = p[0] - corner[0], p[1] - corner[1], p[2] - corner[2]
    return (uy * sz - uz * sy, uz * sx - ux * sz, ux * sy - uy * sx)
