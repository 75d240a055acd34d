"""Cuts a panel into triangles whose border follows its edges."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay, QhullError, cKDTree

from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray

_FROM_BORDER = 0.62  # least distance of inner points from the border, over the spacing
_SLIVER = 0.02  # least height of a triangle over its longest edge


def triangulated(border: FloatArray, spacing: float) -> tuple[FloatArray, IndexArray] | None:
    """Returns points (n,2), the border's first, and counter-clockwise triangles (F,3).

    The inner points are a triangular lattice, the triangles are Delaunay's within the border.

    Args:
        border: (k,2) points around the panel, counter-clockwise, m.
        spacing: wanted edge length, m.

    Returns:
        None if an edge of the border is no edge of the triangles: the border is too coarse for the
        panel's narrowest place.
    """
    inner = _lattice(border, spacing)
    points = np.vstack([border, inner])
    try:
        faces = Delaunay(points).simplices.astype(np.int64)
    except QhullError:
        return None
    a, b, c = (points[faces[:, k]] for k in range(3))
    twice = _cross(b - a, c - a)
    faces[twice < 0] = faces[twice < 0][:, ::-1]
    longest = np.max([_squared(b - a), _squared(c - b), _squared(a - c)], axis=0)
    faces = faces[_inside((a + b + c) / 3.0, border) & (np.abs(twice) > _SLIVER * longest)]
    edges = {(int(i), int(j)) for f in faces for i, j in zip(f, np.roll(f, -1), strict=True)}
    outer = {edge for edge in edges if edge[::-1] not in edges}
    k = len(border)
    whole = outer == {(i, (i + 1) % k) for i in range(k)}
    return (points, faces) if whole and len(np.unique(faces)) == len(points) else None


def _lattice(border: FloatArray, spacing: float) -> FloatArray:
    low, high = border.min(axis=0), border.max(axis=0)
    rows = np.arange(low[1], high[1] + spacing, spacing * np.sqrt(0.75))
    columns = np.arange(low[0], high[0] + 2 * spacing, spacing)
    x, y = np.meshgrid(columns, rows)
    x[1::2] -= 0.5 * spacing
    points = np.column_stack([x.ravel(), y.ravel()])
    points = points[_inside(points, border)]
    if len(points) == 0:
        return points
    # the border as a dense row of points
    t = np.linspace(0.0, 1.0, 8, endpoint=False)[:, None, None]
    dense = ((1 - t) * border + t * np.roll(border, -1, axis=0)).reshape(-1, 2)
    return points[cKDTree(dense).query(points)[0] > _FROM_BORDER * spacing]


def _inside(points: FloatArray, border: FloatArray) -> BoolArray:
    """Returns which points (n,2) lie within a closed border, by crossings of a ray."""
    result = np.zeros(len(points), dtype=bool)
    x, y = points[:, 0], points[:, 1]
    for a, b in zip(border, np.roll(border, -1, axis=0), strict=True):
        crosses = (a[1] > y) != (b[1] > y)
        if crosses.any():
            at = a[0] + (y - a[1]) * (b[0] - a[0]) / (b[1] - a[1] if b[1] != a[1] else 1.0)
            result ^= crosses & (x < at)
    return result


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _squared(v: FloatArray) -> FloatArray:
    return np.asarray((v**2).sum(axis=1))
