"""The nearest point of an intersection of balls and half-spaces, exactly, in three dimensions.

The nearest point lies on the boundaries of some of the sets and inside of the others. The
boundaries of a few spheres and planes meet in a plane, a line, a sphere, a circle or points, and
on each of these the nearest point has a closed form: two spheres meet in their radical plane, so
that any choice of boundaries is one sphere at most, cut by planes. All choices of up to three
boundaries are tried, and of the points that lie in every set the nearest is the answer (no more
than three are needed in three dimensions: Carathéodory's theorem for the cone of the normals).
For the half dozen sets of one control step that is cheaper than an iteration, and ends exactly:
a tenth of a millisecond.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

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

    def holds(self, other: Ball) -> bool:
        """Returns whether all of another ball lies inside."""
        return self.excess(other.center) + other.radius <= 0.0


@dataclass(frozen=True)
class HalfSpace:
    """Points x with normal · x ≤ offset; normal (3,) of length one."""

    normal: FloatArray
    offset: float

    def excess(self, point: FloatArray) -> float:
        """Returns how far `point` (3,) lies outside; negative inside."""
        return float(self.normal @ point) - self.offset

    def holds(self, other: Ball) -> bool:
        """Returns whether all of a ball lies inside."""
        return self.excess(other.center) + other.radius <= 0.0


def nearest(
    point: FloatArray, balls: list[Ball], half_spaces: list[HalfSpace]
) -> FloatArray | None:
    """Returns the point (3,) of all sets that is nearest to `point` (3,); None where none is.

    A point that lies in all sets is returned as it is.

    Args:
        point: (3,) finite.
        balls: one at least.
        half_spaces: may be empty.
    """
    sets: list[Ball | HalfSpace] = [*balls, *half_spaces]
    if all(s.excess(point) <= TOLERANCE for s in sets):
        return point
    smallest = min(balls, key=lambda ball: ball.radius)
    balls = [smallest, *(ball for ball in balls if not ball.holds(smallest))]
    half_spaces = [space for space in half_spaces if not space.holds(smallest)]
    found, best = _search(
        np.asarray(point, dtype=np.float64),
        np.array([ball.center for ball in balls]),
        np.array([ball.radius for ball in balls]),
        np.array([space.normal for space in half_spaces]).reshape(-1, 3),
        np.array([space.offset for space in half_spaces]),
    )
    return best if found else None


@nb.njit(cache=True, nogil=True)
def _search(point, centers, radii, normals, offsets):  # type: ignore[no-untyped-def]
    """Tries every choice of boundaries; i, i, i is one, i, j, j are two."""
    count = len(radii) + len(offsets)
    best, least, found = np.zeros(3), np.inf, False
    active = np.empty(3, dtype=np.int64)
    candidates = np.empty((2, 3))
    for i in range(count):
        for j in range(i, count):
            for k in range(j, count):
                if i == j and j != k:
                    continue
                active[0], active[1], active[2] = i, j, k
                size = 1 if i == k else (2 if j == k else 3)
                for c in range(
                    _stationary(point, active[:size], centers, radii, normals, offsets, candidates)
                ):
                    x = candidates[c]
                    away = np.sqrt(np.sum((x - point) ** 2))
                    if away < least and _inside(x, centers, radii, normals, offsets):
                        best[:], least, found = x, away, True
    return found, best


@nb.njit(cache=True, nogil=True)
def _inside(x, centers, radii, normals, offsets):  # type: ignore[no-untyped-def]
    for i in range(len(radii)):
        if np.sqrt(np.sum((x - centers[i]) ** 2)) > radii[i] + TOLERANCE:
            return False
    for i in range(len(offsets)):
        if np.sum(normals[i] * x) > offsets[i] + TOLERANCE:
            return False
    return True


@nb.njit(cache=True, nogil=True)
def _stationary(point, active, centers, radii, normals, offsets, out):  # type: ignore[no-untyped-def]
    """Writes the points nearest to `point` where boundaries meet to `out` (2,3); returns how many.

    The planes are made orthonormal one by one: q · x = e.
    """
    q, e, planes = np.empty((3, 3)), np.empty(3), 0
    sphere = -1
    for s in active:
        if s >= len(radii):
            normal, offset = normals[s - len(radii)].copy(), offsets[s - len(radii)]
        elif sphere < 0:
            sphere = s
            continue
        else:
            between = centers[s] - centers[sphere]
            apart = np.sqrt(np.sum(between**2))
            if apart < TOLERANCE:
                return 0
            normal = between / apart
            along = 0.5 * (apart + (radii[sphere] ** 2 - radii[s] ** 2) / apart)
            offset = np.sum(normal * centers[sphere]) + along
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
    middle = centers[sphere].copy()
    for p in range(planes):
        middle -= (np.sum(q[p] * middle) - e[p]) * q[p]
    radius = radii[sphere]
    squared = radius**2 - np.sum((middle - centers[sphere]) ** 2)
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
        # every point of the sphere or circle is equally near: any will do
        toward = np.array([0.0, 0.0, 1.0])
        if planes == 1:
            axis = np.zeros(3)
            axis[np.argmin(np.abs(q[0]))] = 1.0
            toward = np.cross(q[0], axis)
        size = np.sqrt(np.sum(toward**2))
    out[0] = middle + (reach / size) * toward
    return 1
