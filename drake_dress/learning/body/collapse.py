"""Removes vertices of a mesh by half-edge collapses: those that stay keep their place.

So positions under every blend shape, and skin weights, are those of the original vertices. The
cost of a collapse is the quadric error of Garland and Heckbert (1997): here the root of the mean
squared distance from the planes of the faces that meet there, m.
"""

from __future__ import annotations

import heapq
from collections import defaultdict

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray

# Cosine of the largest turn of a face; 60 degrees.
_LEAST_COSINE = 0.5


class Collapse:
    """Collapses edges of one half of a symmetric mesh.

    Args:
        position: (n,3), m.
        faces: (F,3) of the half.
        middle: indices on the plane of symmetry, which only move along it.
        tolerance: (n,) largest error at which each vertex may be removed, m; 0 keeps it.
    """

    def __init__(
        self, position: FloatArray, faces: IndexArray, middle: set[int], tolerance: FloatArray
    ) -> None:
        self._position, self._middle, self._tolerance = position, middle, tolerance
        self._faces = {i: tuple(map(int, face)) for i, face in enumerate(faces)}
        self._around: dict[int, set[int]] = defaultdict(set)
        for i, face in self._faces.items():
            for vertex in face:
                self._around[vertex].add(i)
        self._quadric, self._area = _quadrics(position, faces, sorted(middle))

    def run(self) -> IndexArray:
        """Returns the faces (F',3) that are left, as indices of the given vertices."""
        heap: list[tuple[float, int, int]] = []
        for vertex in list(self._around):
            self._push(heap, vertex)
        while heap:
            cost, gone, kept = heapq.heappop(heap)
            if gone not in self._around or kept not in self._neighbours(gone):
                continue
            if cost != self._cost(gone, kept):
                continue  # a newer entry has the present cost
            if self._allowed(gone, kept):
                self._merge(gone, kept)
                for vertex in {kept, *self._neighbours(kept)}:
                    self._push(heap, vertex)
        return np.array(list(self._faces.values()), dtype=np.int64)

    def _push(self, heap: list[tuple[float, int, int]], gone: int) -> None:
        for kept in sorted(self._neighbours(gone)):
            cost = self._cost(gone, kept)
            if cost < self._tolerance[gone]:
                heapq.heappush(heap, (cost, gone, kept))

    def _neighbours(self, vertex: int) -> set[int]:
        return {v for i in self._around[vertex] for v in self._faces[i]} - {vertex}

    def _cost(self, gone: int, kept: int) -> float:
        p = np.append(self._position[kept], 1.0)
        area = self._area[gone] + self._area[kept]
        square = p @ (self._quadric[gone] + self._quadric[kept]) @ p
        return float(np.sqrt(max(square, 0.0) / area))

    def _allowed(self, gone: int, kept: int) -> bool:
        shared = self._around[gone] & self._around[kept]
        if gone in self._middle and (kept not in self._middle or len(shared) != 1):
            return False
        # the link condition: no other vertex is next to both, so the surface stays a manifold
        common = self._neighbours(gone) & self._neighbours(kept)
        if len(common) != len(shared):
            return False
        for i in self._around[gone] - shared:
            before = np.array([self._position[v] for v in self._faces[i]])
            after = np.array([self._position[kept if v == gone else v] for v in self._faces[i]])
            if not _same_direction(before, after):
                return False
        return True

    def _merge(self, gone: int, kept: int) -> None:
        for i in self._around[gone] & self._around[kept]:
            for vertex in self._faces.pop(i):
                self._around[vertex].discard(i)
        for i in self._around.pop(gone):
            a, b, c = (kept if v == gone else v for v in self._faces[i])
            self._faces[i] = (a, b, c)
            self._around[kept].add(i)
        self._quadric[kept] += self._quadric[gone]
        self._area[kept] += self._area[gone]


def _quadrics(
    position: FloatArray, faces: IndexArray, middle: list[int]
) -> tuple[FloatArray, FloatArray]:
    """Returns quadrics (n,4,4) and areas (n,) of the vertices, mirrored faces included."""
    a, b, c = (position[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(area, 1e-15)[:, None]
    plane = np.concatenate([normal, -np.sum(normal * a, axis=1)[:, None]], axis=1)
    quadric, total = np.zeros((len(position), 4, 4)), np.zeros(len(position))
    for k in range(3):
        np.add.at(quadric, faces[:, k], area[:, None, None] * plane[:, :, None] * plane[:, None])
        np.add.at(total, faces[:, k], area)
    mirror = np.diag([1.0, -1.0, 1.0, 1.0])
    quadric[middle] += mirror @ quadric[middle] @ mirror
    total[middle] *= 2.0
    return quadric, np.maximum(total, 1e-15)


def _same_direction(before: FloatArray, after: FloatArray) -> bool:
    first, second = (np.cross(t[1] - t[0], t[2] - t[0]) for t in (before, after))
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    return bool(size > 0.0 and first @ second > _LEAST_COSINE * size)
