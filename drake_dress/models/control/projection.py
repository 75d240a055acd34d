"""The nearest point of an intersection of balls and half-spaces, exactly, in three dimensions.

The nearest point lies on the boundaries of some of the sets and inside of the others. The
boundaries of a few spheres and planes meet in a plane, a line, a sphere, a circle or points, and
on each of these the nearest point has a closed form: two spheres meet in their radical plane, so
that any choice of boundaries is one sphere at most, cut by planes. All choices of up to three
boundaries are tried, and of the points that lie in every set the nearest is the answer (no more
than three are needed in three dimensions: Carathéodory's theorem for the cone of the normals).
For the half dozen sets of one control step that is cheaper than an iteration, and ends exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

# A point counts as inside a set up to this distance, in the unit of the points.
TOLERANCE = 1e-11


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
    sets = [s for s in sets if s is smallest or not s.holds(smallest)]
    best, distance = None, np.inf
    for count in (1, 2, 3):
        for active in combinations(sets, count):
            for x in _stationary(point, active):
                away = float(np.linalg.norm(x - point))
                if away < distance and all(s.excess(x) <= TOLERANCE for s in sets):
                    best, distance = x, away
    return best


def _stationary(point: FloatArray, active: tuple[Ball | HalfSpace, ...]) -> list[FloatArray]:
    """Returns the points nearest to `point` where the boundaries of `active` meet."""
    spheres = [s for s in active if isinstance(s, Ball)]
    planes = [(s.normal, s.offset) for s in active if isinstance(s, HalfSpace)]
    for other in spheres[1:]:
        between = other.center - spheres[0].center
        apart = float(np.linalg.norm(between))
        if apart < TOLERANCE:
            return []
        n = between / apart
        along = 0.5 * (apart + (spheres[0].radius ** 2 - other.radius**2) / apart)
        planes.append((n, float(n @ spheres[0].center) + along))
    foot = _on_planes(point, planes)
    if foot is None or not spheres:
        return [] if foot is None else [foot]
    middle = _on_planes(spheres[0].center, planes)
    if middle is None:
        return []
    squared = spheres[0].radius ** 2 - float(np.sum((middle - spheres[0].center) ** 2))
    if squared < -TOLERANCE * spheres[0].radius:
        return []
    reach = np.sqrt(max(0.0, squared))
    if len(planes) == 2:
        line = np.cross(planes[0][0], planes[1][0])
        line = line / np.linalg.norm(line)
        return [middle + reach * line, middle - reach * line]
    toward = foot - middle
    size = float(np.linalg.norm(toward))
    if size < TOLERANCE * spheres[0].radius:
        # every point of the sphere or circle is equally near: any will do
        n = planes[0][0] if planes else np.array([0.0, 0.0, 1.0])
        toward = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
        size = float(np.linalg.norm(toward))
    return [middle + (reach / size) * toward]


def _on_planes(point: FloatArray, planes: list[tuple[FloatArray, float]]) -> FloatArray | None:
    """Returns the point of all planes nearest to `point`; None where they are parallel."""
    if not planes:
        return point
    normals = np.array([n for n, _ in planes])
    gram = normals @ normals.T
    if np.linalg.det(gram) < 1e-12:
        return None
    offsets = np.array([offset for _, offset in planes])
    foot: FloatArray = point - normals.T @ np.linalg.solve(gram, normals @ point - offsets)
    return foot
