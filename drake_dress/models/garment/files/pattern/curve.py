"""Edges of panels: lines, quadratic and cubic Bézier curves, and arcs of circles."""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray

_FINE = 400  # points of a curve, on which its arc length is measured
_LARGEST = 1e9  # number in any unit
_KINDS = "quadratic, cubic or circle"


class Curve:
    """A curve in the plane of a panel.

    Args:
        points: (k,2) points from start to end, m, dense enough to be its shape.
    """

    def __init__(self, points: FloatArray) -> None:
        self._points = points
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        self._arc = np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def length(self) -> float:
        """Arc length, m."""
        return float(self._arc[-1])

    def sampled(self, count: int) -> FloatArray:
        """Returns (count + 1, 2) points at equal arc lengths."""
        at = np.linspace(0.0, self.length, count + 1)
        return np.column_stack([np.interp(at, self._arc, self._points[:, k]) for k in (0, 1)])


def curve_of(
    start: FloatArray,
    end: FloatArray,
    curvature: Any,
    absolute: float | None,
    scale: float,
    where: tuple[str, str],
) -> Curve:
    """Returns the curve of an edge.

    Args:
        start: (2,), m.
        end: (2,), m.
        curvature: what the file says; None for a straight edge. A list of two numbers is the
            control point of a quadratic curve; otherwise a `type` and its `params`.
        absolute: m per unit, if control points are in the panel's axes; None if they are relative:
            the first number along the edge, the second across it to the left, both over its length.
        scale: m per unit, of radii.
        where: source and key, for messages.

    Raises:
        UserError: the curvature is malformed, or no circle of that radius joins the ends.
    """
    if curvature is None:
        return Curve(np.stack([start, end]))
    if isinstance(curvature, list):
        curvature = {"type": "quadratic", "params": [curvature]}
    kind = curvature.get("type") if isinstance(curvature, dict) else None
    params = curvature.get("params") if isinstance(curvature, dict) else None
    if kind == "circle":
        return _circle(start, end, params, scale, where)
    if kind not in ("quadratic", "cubic"):
        raise UserError(*where, f"has type {kind!r}, expected {_KINDS}")
    count = 1 if kind == "quadratic" else 2
    try:
        given = np.asarray(params, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        given = np.zeros(0)
    if given.shape != (count, 2) or not np.isfinite(given).all():
        raise UserError(*where, f"has params {params!r}, expected {count} control points")
    along = end - start
    across = np.array([-along[1], along[0]])
    if absolute is None:
        inner = start + given[:, :1] * along + given[:, 1:] * across
    else:
        inner = given * absolute
    return Curve(_bezier(np.vstack([start, inner, end])))


def _bezier(control: FloatArray) -> FloatArray:
    """Returns points of the Bézier curve of control points, by de Casteljau's construction."""
    t = np.linspace(0.0, 1.0, _FINE)[:, None, None]
    points = np.repeat(control[None], _FINE, axis=0)
    while points.shape[1] > 1:
        points = (1.0 - t) * points[:, :-1] + t * points[:, 1:]
    return np.asarray(points[:, 0])


def _circle(
    start: FloatArray, end: FloatArray, params: Any, scale: float, where: tuple[str, str]
) -> Curve:
    """Returns an arc with the given radius; of the four, the flags choose as in SVG paths.

    The first flag asks for the longer arc, the second for the one that turns counter-clockwise.
    """
    if (
        not isinstance(params, list)
        or len(params) != 3
        or not all(isinstance(p, int | float) and abs(p) < _LARGEST for p in params)
    ):
        raise UserError(*where, f"has params {params!r}, expected radius, large_arc and right")
    radius, large, right = float(params[0]) * scale, bool(params[1]), bool(params[2])
    chord = end - start
    half = 0.5 * float(np.linalg.norm(chord))
    if not radius >= half * (1.0 - 1e-6):
        raise UserError(
            *where,
            f"has radius {params[0]}, expected at least {half / scale:.4g}, half of the edge",
        )
    left = np.array([-chord[1], chord[0]]) / (2.0 * half)
    away = float(np.sqrt(max(radius**2 - half**2, 0.0)))
    center = 0.5 * (start + end) + (away if right != large else -away) * left
    first = np.arctan2(*(start - center)[::-1])
    last = np.arctan2(*(end - center)[::-1])
    turn = (last - first) % (2.0 * np.pi)
    if not right:
        turn -= 2.0 * np.pi
    angle = first + np.linspace(0.0, 1.0, _FINE) * turn
    points = center + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    points[0], points[-1] = start, end
    return Curve(points)
