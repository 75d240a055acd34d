"""Curves that a coat is made of: arcs of an ellipse, edges of panels, and patches between them."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray

_DEPTH_RATIO = 0.55  # depth over width of the chest ellipse, from body measures


def unit_ellipse(u: FloatArray) -> tuple[FloatArray, float]:
    """Returns points at arc fractions u of an ellipse of half width 1, and their polygon's girth.

    The mirror image is the polygon's other half.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, 2001)
    curve = np.column_stack([_DEPTH_RATIO * np.cos(angle), np.sin(angle)])
    along = arc(curve)
    points = np.column_stack([np.interp(u * along[-1], along, curve[:, k]) for k in (0, 1)])
    return points, 2.0 * (length(points) + float(points[0, 1]))


_T = np.linspace(0.0, 1.0, 100)[:, None]
_SIN, _COS = np.sin(0.5 * np.pi * _T), np.cos(0.5 * np.pi * _T)


def arch(corner: FloatArray, tip: FloatArray) -> FloatArray:
    """Returns the armhole's edge: a quarter ellipse that starts upward and ends level."""
    curve = corner + (tip - corner) * _SIN
    curve[:, 0] = corner[0] * _COS[:, 0]
    return curve


def scoop(middle: FloatArray, neck: FloatArray) -> FloatArray:
    """Returns the neckline: a blend of a V and a quarter ellipse.

    The ellipse alone would squeeze the columns of the panel.
    """
    bow = (neck - middle) * (1.0 - _COS)
    bow[:, 1] = (neck[1] - middle[1]) * _SIN[:, 0]
    return middle + 0.35 * bow + 0.65 * (neck - middle) * _T


def bend(low: FloatArray, high: FloatArray) -> FloatArray:
    """Returns the inner edge of a panel: it starts upward and then leans toward the neck."""
    control = np.array([low[0], low[1], 0.5 * (low[2] + high[2])])
    return (1 - _T) ** 2 * low + 2 * _T * (1 - _T) * control + _T**2 * high


def cubic(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Returns the cubic Bézier curve of four control points."""
    s = 1 - _T
    return np.asarray(s**3 * a + 3 * s**2 * _T * b + 3 * s * _T**2 * c + _T**3 * d)


def arc(curve: FloatArray) -> FloatArray:
    """Returns the arc length from a curve's first point to each of its points."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])


def length(curve: FloatArray) -> float:
    """Returns the length of a curve of points."""
    return float(arc(curve)[-1])


def resample(curve: FloatArray, count: int) -> FloatArray:
    """Returns count + 1 points at equal arc lengths."""
    along = arc(curve)
    at = np.linspace(0.0, along[-1], count + 1)
    return np.column_stack([np.interp(at, along, curve[:, k]) for k in range(3)])


def coons(bottom: FloatArray, top: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Returns the Coons patch (rows + 1, columns + 1, 3) between four border curves."""
    v = np.linspace(0.0, 1.0, len(start))[:, None, None]
    u = np.linspace(0.0, 1.0, len(bottom))[None, :, None]
    between_rows = (1 - v) * bottom[None] + v * top[None]
    between_columns = (1 - u) * start[:, None] + u * end[:, None]
    corners = (1 - v) * ((1 - u) * bottom[0] + u * bottom[-1]) + v * (
        (1 - u) * top[0] + u * top[-1]
    )
    return np.asarray(between_rows + between_columns - corners)
