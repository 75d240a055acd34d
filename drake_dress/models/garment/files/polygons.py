"""Cuts polygons into triangles.

Quads are cut along the shorter diagonal that lies inside and leaves two triangles. Convex polygons
are cut in a zigzag, which avoids long fans. All others are cut by ear clipping in the plane of
their vector area, the ear with the shortest diagonal first (Meisters 1975, "Polygons have ears").
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray

MaskArray = BoolArray

# Sine of a corner's angle, below which it counts as straight.
_STRAIGHT = 1e-6
# Share of a quad's area, below which a triangle of it is none: the quad has a straight corner.
_LEAST_SHARE = 1e-3


def triangulated(
    position: FloatArray, polygons: Sequence[Sequence[int]]
) -> tuple[IndexArray, IndexArray]:
    """Returns (F,3) triangles, oriented as their polygons, and (F,) the polygons, ascending.

    Args:
        position: (n,3).
        polygons: node indices of each, at least three.
    """
    triangles: list[IndexArray] = [np.empty((0, 3), dtype=np.int64)]
    owners: list[IndexArray] = [np.empty(0, dtype=np.int64)]
    counts = np.array([len(polygon) for polygon in polygons], dtype=np.int64)
    for count in np.unique(counts).tolist():
        chosen = np.flatnonzero(counts == count)
        corners = np.array([polygons[k] for k in chosen.tolist()], dtype=np.int64)
        if count == 3:
            cut = corners[:, None, :]
        elif count == 4:
            cut = _quads(position, corners)
        else:
            cut = _larger(position, corners)
        triangles.append(cut.reshape(-1, 3))
        owners.append(np.repeat(chosen, count - 2))
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(triangles)[order], owner[order]


def corners_triangulated(
    position: FloatArray, polygons: Sequence[Sequence[int]]
) -> tuple[IndexArray, IndexArray, IndexArray]:
    """Returns triangles of numbered corners, for files that say something of each corner.

    Args:
        position: (n,3).
        polygons: node indices of each, at least three.

    Returns:
        (k,) the node of each corner of all polygons in order; (F,3) triangles as indices of
        corners; and (F,) the polygons, ascending.
    """
    node = np.array([corner for polygon in polygons for corner in polygon], dtype=np.int64)
    ends = np.cumsum([0, *map(len, polygons)]).tolist()
    corner, owner = triangulated(position[node], [range(a, b) for a, b in pairwise(ends)])
    return node, corner, owner


def _quads(position: FloatArray, corners: IndexArray) -> IndexArray:
    """Returns (k,2,3) triangles of (k,4) quads."""
    first, second = corners[:, [[0, 1, 2], [0, 2, 3]]], corners[:, [[0, 1, 3], [1, 2, 3]]]
    share_first, share_second = (_least_share(position, corners, cut) for cut in (first, second))
    a, b, c, d = (position[corners[:, k]] for k in range(4))
    longer = np.linalg.norm(a - c, axis=1) > np.linalg.norm(b - d, axis=1)
    both = np.minimum(share_first, share_second) > _LEAST_SHARE
    use_second = np.where(both, longer, share_second > share_first)
    return np.where(use_second[:, None, None], second, first)


def _lie_inside(position: FloatArray, corners: IndexArray, cut: IndexArray) -> MaskArray:
    """Returns (k,) whether all triangles of a cut are oriented as their polygon."""
    return np.asarray(_least_share(position, corners, cut) > 0.0)


def _least_share(position: FloatArray, corners: IndexArray, cut: IndexArray) -> FloatArray:
    """Returns (k,) the smallest share that a triangle of a cut has of its polygon's area."""
    normal = _vector_area(position[corners])
    x = position[cut]
    areas = np.cross(x[:, :, 1] - x[:, :, 0], x[:, :, 2] - x[:, :, 0])
    size = np.maximum((normal**2).sum(axis=1), 1e-300)
    return np.asarray(np.einsum("kti,ki->kt", areas, normal).min(axis=1) / size)


def _larger(position: FloatArray, corners: IndexArray) -> IndexArray:
    """Returns (k,n-2,3) triangles of (k,n) polygons."""
    n = corners.shape[1]
    cut = corners[:, _zigzag(n)]
    convex = _corner_sines(position[corners]).min(axis=1) > _STRAIGHT
    # corners of a convex outline turn once around; those of a star turn more often
    convex &= _lie_inside(position, corners, cut)
    for k in np.flatnonzero(~convex):
        cut[k] = _without_ears(position[corners[k]], corners[k])
    return cut


def _zigzag(n: int) -> IndexArray:
    """Returns (n-2,3) corner numbers of the triangles of a convex polygon with n corners."""
    triangles = []
    low, high = 0, n - 1
    while high - low >= 2:
        triangles.append((low, low + 1, high))
        low += 1
        if high - low >= 2:
            triangles.append((low, high - 1, high))
            high -= 1
    return np.array(triangles, dtype=np.int64)


def _vector_area(x: FloatArray) -> FloatArray:
    """Returns (k,3) twice the vector area of polygons (k,n,3)."""
    away = x - x[:, :1]
    return np.asarray(np.cross(away, np.roll(away, -1, axis=1)).sum(axis=1))


def _corner_sines(x: FloatArray) -> FloatArray:
    """Returns (k,n) sines of the turns at the corners of polygons (k,n,3), positive if convex."""
    normal = _vector_area(x)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    to, away = x - np.roll(x, 1, axis=1), np.roll(x, -1, axis=1) - x
    turn = np.einsum("kni,ki->kn", np.cross(to, away), normal)
    size = np.linalg.norm(to, axis=2) * np.linalg.norm(away, axis=2)
    return np.asarray(turn / np.maximum(size, 1e-300))


def _without_ears(x: FloatArray, corners: IndexArray) -> IndexArray:
    """Returns (n-2,3) triangles of one polygon (n,3) by ear clipping."""
    at = _flattened(x)
    left = np.arange(len(corners))
    triangles = []
    while len(left) > 3:
        k = _ear(at[left])
        triangles.append(left[[k - 1, k, (k + 1) % len(left)]])
        left = np.delete(left, k)
    triangles.append(left)
    return corners[np.array(triangles)]


def _flattened(x: FloatArray) -> FloatArray:
    """Returns (n,2) a polygon in the plane of its vector area, counter-clockwise."""
    normal = _vector_area(x[None])[0]
    normal = normal / max(float(np.linalg.norm(normal)), 1e-300)
    aside = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    aside /= max(float(np.linalg.norm(aside)), 1e-300)
    return np.stack([x @ aside, x @ np.cross(normal, aside)], axis=1)


def _ear(at: FloatArray) -> int:
    """Returns the corner of a plane polygon to cut off: an ear, or else the most convex one."""
    before, after = np.roll(at, 1, axis=0), np.roll(at, -1, axis=0)
    to, away = at - before, after - at
    sine = _cross(to, away) / np.maximum(
        np.linalg.norm(to, axis=1) * np.linalg.norm(away, axis=1), 1e-300
    )
    diagonal = np.linalg.norm(after - before, axis=1)
    for k in np.argsort(np.where(sine > _STRAIGHT, diagonal, np.inf), kind="stable"):
        if sine[k] <= _STRAIGHT:
            break
        a, b, c = before[k], at[k], after[k]
        sides = [_cross(q - p, at - p) for p, q in ((a, b), (b, c), (c, a))]
        within = np.minimum.reduce(sides) >= 0.0
        # the ear's own corners, and nodes at the same place, do not block it
        within &= (np.abs(at[:, None, :] - np.stack([a, b, c])).max(axis=2) > 0.0).all(axis=1)
        if not within.any():
            return int(k)
    return int(np.argmax(sine))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
