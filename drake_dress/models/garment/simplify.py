"""Brings a mesh to a spacing: halves edges that are too long, then merges nodes that are too near.

Nodes are merged edge by edge, the shortest first, and only where the mesh stays manifold (the
nodes' common neighbours are just those of the edge's faces) and no face turns over. Clustering
nodes by cells of a grid would be simpler, and tears or pinches sleeves and seams.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from drake_dress.models.garment.mesh import (
    FloatArray,
    IntArray,
    boundary_loops,
    edge_lengths,
    unique_edges,
)

_SHORTEST = 0.75  # edges are merged up to this part of the spacing: the mean comes near 1
_LONGEST = 1.5  # no merging makes an edge longer than this by the spacing
_LEAST_LOOP = 8  # nodes that are left of a loop


def refine(
    position: FloatArray, faces: IntArray, loops: Sequence[IntArray]
) -> tuple[FloatArray, IntArray, list[IntArray]]:
    """Returns the mesh with every triangle cut into four, and the loops through the new nodes.

    Old nodes keep their index.

    Args:
        position: (n,3), m.
        faces: (F,3).
        loops: closed chains of edges, as node indices.
    """
    n = len(position)
    edges = unique_edges(faces).astype(np.int64)
    key = edges @ np.array([n, 1])

    def middle(a: IntArray, b: IntArray) -> IntArray:
        pair = np.sort(np.stack([a, b], axis=1).astype(np.int64), axis=1) @ np.array([n, 1])
        return (n + np.searchsorted(key, pair)).astype(np.int32)

    a, b, c = faces.T
    ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
    corners = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return (
        np.concatenate([position, position[edges].mean(axis=1)]),
        np.concatenate([np.stack(corner, axis=1) for corner in corners]),
        [np.stack([q, middle(q, np.roll(q, -1))], axis=1).ravel() for q in loops],
    )


def coarsen(
    position: FloatArray, faces: IntArray, loops: Sequence[IntArray], spacing: float
) -> tuple[FloatArray, IntArray, npt.NDArray[np.int32]]:
    """Returns positions, faces, and for each old node the new one that it has become.

    Nodes of a loop or of a boundary only merge with their neighbours along it. The mean edge of
    the result is near `spacing` where the mesh was finer; nothing else happens where it was not.

    Args:
        position: (n,3), m.
        faces: (F,3) of an oriented manifold.
        loops: closed chains of edges to keep, as node indices.
        spacing: wanted mean edge length, m.
    """
    return _Merging(position, faces, loops, spacing).run()


def to_spacing(
    position: FloatArray, faces: IntArray, loops: Sequence[IntArray], spacing: float
) -> tuple[FloatArray, IntArray, list[IntArray], npt.NDArray[np.int32]]:
    """Returns positions, faces, loops, and for each old node the new one, at about `spacing`.

    Args:
        position: (n,3), m.
        faces: (F,3) of an oriented manifold.
        loops: closed chains of edges to keep, as node indices.
        spacing: wanted mean edge length, m.
    """
    n = len(position)
    kept = list(loops)
    while edge_lengths(position, faces).max() > _LONGEST * spacing:
        position, faces, kept = refine(position, faces, kept)
    position, faces, became = coarsen(position, faces, kept, spacing)
    return position, faces, [_without_repeats(became[loop]) for loop in kept], became[:n]


def _without_repeats(loop: IntArray) -> IntArray:
    return np.asarray(loop[loop != np.roll(loop, 1)], dtype=np.int32)


class _Merging:
    """The state of a run of edge merging; Python lists, since every step is a few elements."""

    def __init__(
        self, position: FloatArray, faces: IntArray, loops: Sequence[IntArray], spacing: float
    ) -> None:
        self.x = position.copy()
        self.face: list[list[int] | None] = faces.tolist()
        self.spacing = spacing
        self.parent = list(range(len(position)))
        self.around: list[set[int]] = [set() for _ in range(len(position))]
        for f, triangle in enumerate(faces.tolist()):
            for node in triangle:
                self.around[node].add(f)
        # each kept chain is a graph of its own: who is next to whom along it
        self.chain: list[dict[int, set[int]]] = []
        for loop in [*boundary_loops(faces), *loops]:
            order = loop.tolist()
            self.chain.append(
                {q: {order[i - 1], order[(i + 1) % len(order)]} for i, q in enumerate(order)}
            )

    def run(self) -> tuple[FloatArray, IntArray, npt.NDArray[np.int32]]:
        faces = np.array(self.face, dtype=np.int32)
        edges = unique_edges(faces)
        length = np.linalg.norm(self.x[edges[:, 0]] - self.x[edges[:, 1]], axis=1)
        limit = _SHORTEST * self.spacing
        queue = [
            (float(d), int(a), int(b)) for d, (a, b) in zip(length, edges, strict=True) if d < limit
        ]
        heapq.heapify(queue)
        while queue:
            d, a, b = heapq.heappop(queue)
            if self.parent[a] != a or self.parent[b] != b:
                continue
            if abs(d - float(np.linalg.norm(self.x[a] - self.x[b]))) > 1e-12:
                continue
            if self._merge(a, b):
                for other in self._neighbours(a):
                    d = float(np.linalg.norm(self.x[a] - self.x[other]))
                    if d < limit:
                        heapq.heappush(queue, (d, a, other))
        return self._result()

    def _merge(self, a: int, b: int) -> bool:
        """Merges b into a where that is allowed."""
        target = self._target(a, b)
        if target is None:
            return False
        shared = self.around[a] & self.around[b]
        common = self._neighbours(a) & self._neighbours(b)
        if len(common) != len(shared) or not shared:
            return False
        others = (self.around[a] | self.around[b]) - shared
        if not self._stays_sound(a, b, target, others):
            return False
        self.x[a] = target
        self.parent[b] = a
        for f in shared:
            for node in self.face[f] or ():
                self.around[node].discard(f)
            self.face[f] = None
        for f in self.around[b]:
            self.face[f] = [a if node == b else node for node in self.face[f] or ()]
            self.around[a].add(f)
        for chain in self.chain:
            if b in chain:
                beside = chain.pop(b)
                chain[a] = (chain.get(a, set()) | beside) - {a, b}
                for node in beside - {a}:
                    chain[node] = (chain[node] - {b}) | {a}
        return True

    def _target(self, a: int, b: int) -> FloatArray | None:
        """Where the two become one: on the chain, if one lies on it; None if that breaks it."""
        on_a = [a in chain for chain in self.chain]
        on_b = [b in chain for chain in self.chain]
        for chain, with_a, with_b in zip(self.chain, on_a, on_b, strict=True):
            if with_a and with_b and (b not in chain[a] or len(chain) <= _LEAST_LOOP):
                return None
        if any(on_a) and any(on_b) and on_a != on_b:
            return None  # different chains, or a crossing of two
        # a chain's nodes stay where they are, its corners first: midpoints would shrink every girth
        if any(on_a) and any(on_b):
            keep_a = all(
                self._loss(chain, a) >= self._loss(chain, b) for chain in self.chain if a in chain
            )
            return np.asarray(self.x[a if keep_a else b].copy())
        if any(on_a):
            return np.asarray(self.x[a].copy())
        if any(on_b):
            return np.asarray(self.x[b].copy())
        return np.asarray(0.5 * (self.x[a] + self.x[b]))

    def _loss(self, chain: dict[int, set[int]], node: int) -> float:
        """By how much a chain becomes shorter without a node, m."""
        before, after = (self.x[q] for q in chain[node])
        around = np.linalg.norm(self.x[node] - before) + np.linalg.norm(after - self.x[node])
        return float(around - np.linalg.norm(after - before))

    def _stays_sound(self, a: int, b: int, target: FloatArray, others: set[int]) -> bool:
        faces = np.array([self.face[f] for f in others])
        if len(faces) == 0:
            return False
        before = self.x[faces]
        moved = (faces == a) | (faces == b)
        after = np.where(moved[:, :, None], target, before)
        if np.linalg.norm(after - target, axis=2).max() > _LONGEST * self.spacing:
            return False
        old = np.cross(before[:, 1] - before[:, 0], before[:, 2] - before[:, 0])
        new = np.cross(after[:, 1] - after[:, 0], after[:, 2] - after[:, 0])
        size = np.linalg.norm(new, axis=1)
        if ((old * new).sum(axis=1) < 0.3 * np.linalg.norm(old, axis=1) * size).any():
            return False
        # twice the area by the longest side squared: 0.87 for an equilateral triangle, 0: a needle
        sides = np.linalg.norm(after - np.roll(after, -1, axis=1), axis=2).max(axis=1)
        return bool((size > 0.15 * sides**2).all())

    def _neighbours(self, node: int) -> set[int]:
        return {q for f in self.around[node] for q in self.face[f] or ()} - {node}

    def _result(self) -> tuple[FloatArray, IntArray, npt.NDArray[np.int32]]:
        root = np.array([self._root(node) for node in range(len(self.parent))])
        kept = np.unique(root)
        faces = np.array([f for f in self.face if f is not None], dtype=np.int64)
        return (
            self.x[kept],
            np.searchsorted(kept, faces).astype(np.int32),
            np.searchsorted(kept, root).astype(np.int32),
        )

    def _root(self, node: int) -> int:
        while self.parent[node] != node:
            node = self.parent[node]
        return node
