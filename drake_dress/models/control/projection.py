"""Exact projection onto an intersection of balls and half-spaces in three dimensions.

The nearest point lies on the boundaries of some of the sets and inside the others. The boundaries
of a few spheres and planes intersect in a plane, a line, a sphere, a circle or points, and on each
of these the nearest point has a closed form. Two spheres intersect in their radical plane, so any
choice of boundaries reduces to at most one sphere, cut by planes. All choices of up to three
boundaries are tried, and the nearest of the points that lie in every set is the answer. Three
boundaries suffice in three dimensions (Carathéodory's theorem for the cone of the normals). For the
half dozen sets of one control step this takes a tenth of a millisecond. It is cheaper than an
iterative method, and exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray

# Codes for the kind of a set in its row.
HALF_SPACE, BALL = 0.0, 1.0
# A point counts as inside a set up to this distance, in the unit of the points.
TOLERANCE = 1e-11
# Planes whose normals enclose a smaller angle count as parallel, rad.
_PARALLEL = 1e-6


@dataclass(frozen=True)
class Ball:
    """Points x with |x - center| ≤ radius; center (3,)."""

    center: FloatArray
    radius: float

    def excess(self, point: FloatArray) -> float:
        """Returns how far `point` (3,) lies outside; negative inside."""
        return float(np.linalg.norm(point - self.center)) - self.radius

    @property
    def row(self) -> FloatArray:
        """Row (5,) for `find_nearest`."""
        return np.array([BALL, *self.center, self.radius])


@dataclass(frozen=True)
class HalfSpace:
    """Points x with normal · x ≤ offset; normal (3,) of length one."""

    normal: FloatArray
    offset: float

    def excess(self, point: FloatArray) -> float:
        """Returns how far `point` (3,) lies outside; negative inside."""
        return float(self.normal @ point) - self.offset

    @property
    def row(self) -> FloatArray:
        """Row (5,) for `find_nearest`."""
        return np.array([HALF_SPACE, *self.normal, self.offset])


def nearest(
    point: FloatArray, balls: Sequence[Ball], half_spaces: Sequence[HalfSpace]
) -> FloatArray | None:
    """Returns the point (3,) in all sets that is nearest to `point` (3,); None if there is none.

    A point that lies in all sets is returned unchanged.

    Args:
        point: (3,) finite.
        balls: at least one.
        half_spaces: may be empty.
    """
    sets: list[Ball | HalfSpace] = [*balls, *half_spaces]
    rows = np.array([s.row for s in sets])
    out = np.empty(3)
    if not find_nearest(np.asarray(point, dtype=np.float64), rows, out):
        return None
    return point if np.array_equal(out, point) else out


@nb.njit(cache=True, nogil=True)
def excess(row, point):  # type: ignore[no-untyped-def]
    """Returns how far `point` (3,) lies outside a set (5,); negative inside."""
    if row[0] == BALL:
        return (
            np.sqrt((point[0] - row[1]) ** 2 + (point[1] - row[2]) ** 2 + (point[2] - row[3]) ** 2)
            - row[4]
        )
    return row[1] * point[0] + row[2] * point[1] + row[3] * point[2] - row[4]


@nb.njit(cache=True, nogil=True)
def find_nearest(point, sets, out):  # type: ignore[no-untyped-def]
    """Writes the point in all sets that is nearest to `point`; returns whether there is one.

    Args:
        point: (3,) finite.
        sets: (S,5) one row each: BALL, center, radius, or HALF_SPACE, normal, offset. At least one
            is a ball.
        out: (3,) written; may be `point`.
    """
    inside = True
    smallest = -1
    for k in range(len(sets)):
        inside = inside and excess(sets[k], point) <= TOLERANCE
        if sets[k, 0] == BALL and (smallest < 0 or sets[k, 4] < sets[smallest, 4]):
            smallest = k
    if inside:
        out[:] = point
        return True
    # a set that contains the whole smallest ball is redundant
    kept, count = np.empty_like(sets), 1
    kept[0] = sets[smallest]
    for k in range(len(sets)):
        if k != smallest and excess(sets[k], kept[0, 1:4]) + kept[0, 4] > 0.0:
            kept[count] = sets[k]
            count += 1
    return _search(point.copy(), kept[:count], out)


@nb.njit(cache=True, nogil=True)
def _search(point, sets, out):  # type: ignore[no-untyped-def]
    """Tries every choice of up to three boundaries; i, i, i is one, i, j, j are two."""
    least, found = np.inf, False
    active = np.empty(3, dtype=np.int64)
    candidates = np.empty((2, 3))
    for i in range(len(sets)):
        for j in range(i, len(sets)):
            for k in range(j, len(sets)):
                if i == j and j != k:
                    continue
                active[0], active[1], active[2] = i, j, k
                size = 1 if i == k else (2 if j == k else 3)
                for c in range(_stationary(point, active[:size], sets, candidates)):
                    x = candidates[c]
                    away = np.sqrt(np.sum((x - point) ** 2))
                    if away < least and _inside(x, sets):
                        out[:], least, found = x, away, True
    return found


@nb.njit(cache=True, nogil=True)
def _inside(x, sets):  # type: ignore[no-untyped-def]
    for k in range(len(sets)):
        if excess(sets[k], x) > TOLERANCE:
            return False
    return True


@nb.njit(cache=True, nogil=True)
def _stationary(point, active, sets, out):  # type: ignore[no-untyped-def]
    """Writes candidate points where all `active` boundaries meet to `out` (2,3); returns how many.

    The planes q · x = e are orthonormalized one by one.
    """
    q, e, planes = np.empty((3, 3)), np.empty(3), 0
    sphere = -1
    for s in active:
        if sets[s, 0] == HALF_SPACE:
            normal, offset = sets[s, 1:4].copy(), sets[s, 4]
        elif sphere < 0:
            sphere = s
            continue
        else:
            between = sets[s, 1:4] - sets[sphere, 1:4]
            apart = np.sqrt(np.sum(between**2))
            if apart < TOLERANCE:
                return 0
            normal = between / apart
            along = 0.5 * (apart + (sets[sphere, 4] ** 2 - sets[s, 4] ** 2) / apart)
            offset = np.sum(normal * sets[sphere, 1:4]) + along
        for p in range(planes):
            share = np.sum(normal * q[p])
            normal -= share * q[p]
            offset -= share * e[p]
        size = np.sqrt(np.sum(normal**2))
        if size < _PARALLEL:
            return 0
        q[planes], e[planes] = normal / size, offset / size
        planes += 1

    foot = point.copy()
    for p in range(planes):
        foot -= (np.sum(q[p] * foot) - e[p]) * q[p]
    if sphere < 0:
        out[0] = foot
        return 1
    middle = sets[sphere, 1:4].copy()
    for p in range(planes):
        middle -= (np.sum(q[p] * middle) - e[p]) * q[p]
    radius = sets[sphere, 4]
    squared = radius**2 - np.sum((middle - sets[sphere, 1:4]) ** 2)
    if squared < -TOLERANCE * radius:
        return 0
    reach = np.sqrt(max(0.0, squared))
    if planes == 2:
        line = np.cross(q[0], q[1])
        out[0], out[1] = middle + reach * line, middle - reach * line
        return 2
    toward = foot - middle
    size = np.sqrt(np.sum(toward**2))
    if size < TOLERANCE * radius:
        # every point of the sphere or circle is equally near, so any one serves
        toward = np.array([0.0, 0.0, 1.0])
        if planes == 1:
            axis = np.zeros(3)
            axis[np.argmin(np.abs(q[0]))] = 1.0
            toward = np.cross(q[0], axis)
        size = np.sqrt(np.sum(toward**2))
    out[0] = middle + (reach / size) * toward
    return 1
