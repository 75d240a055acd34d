"""Cuts a mesh by a plane and measures the cut as a tape does: around its convex hull."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError

from drake_dress.models.arrays import FloatArray, IndexArray


@dataclass(frozen=True)
class Cut:
    """The outline of a mesh in a plane.

    Attributes:
        segments: (k,2,2) of the outline in the plane, from the given point, m. In a horizontal
            plane the axes are forward and left.
        ends: (k,2) numbers of the mesh edges that the segments end on.
        hull: (h,2) corners of its convex hull, in order, m.
    """

    segments: FloatArray
    ends: IndexArray
    hull: FloatArray

    @cached_property
    def girth(self) -> float:
        """Length of a tape around the cut, m."""
        return _perimeter(self.hull)

    @property
    def radius(self) -> float:
        """Radius of the circle of the same girth, m."""
        return self.girth / (2.0 * np.pi)

    @property
    def area(self) -> float:
        """Area inside the tape, m²."""
        x, y = self.hull.T
        return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))

    @property
    def extents(self) -> FloatArray:
        """Depth and width (2,) of the cut along the plane's axes, m."""
        return np.ptp(self.hull, axis=0)

    @property
    def mean_distance(self) -> float:
        """Mean distance of the outline from the given point, by length, m."""
        length = np.linalg.norm(self.segments[:, 1] - self.segments[:, 0], axis=1)
        distance = np.linalg.norm(self.segments.mean(axis=1), axis=1)
        return float(length @ distance / length.sum())

    def pieces(self) -> list[Cut]:
        """Returns the connected pieces of the cut, the one of the greatest girth first.

        Raises:
            ValueError: no piece has an area.
        """
        numbers, ends = np.unique(self.ends, return_inverse=True)
        ends = ends.reshape(self.ends.shape)
        links = coo_array((np.ones(len(ends)), ends.T), shape=(len(numbers), len(numbers)))
        _, labels = connected_components(links, directed=False)
        of_segment = labels[ends[:, 0]]
        pieces = []
        for label in np.unique(of_segment):
            own = self.segments[of_segment == label]
            if len(own) > 2:
                hull = _hull(own.reshape(-1, 2))
                pieces.append(Cut(own, self.ends[of_segment == label], hull))
        if not pieces:
            raise ValueError("the plane misses the mesh")
        return sorted(pieces, key=lambda piece: -piece.girth)


def cut(vertices: FloatArray, faces: IndexArray, point: FloatArray, normal: FloatArray) -> Cut:
    """Returns the cut of a mesh by a plane.

    Args:
        vertices: (n,3), m.
        faces: (F,3), the part of the mesh that is cut.
        point: (3,) of the plane, m.
        normal: (3,) unit vector.

    Raises:
        ValueError: the plane misses the mesh.
    """
    height = (vertices - point) @ normal
    above = height[faces] > 0.0
    crossed = faces[above.any(axis=1) & ~above.all(axis=1)]
    if len(crossed) < 2:
        raise ValueError("the plane misses the mesh")
    segments, ends = _segments(vertices, height, crossed)
    in_plane = (segments - point) @ plane_axes(normal).T
    return Cut(in_plane, ends, _hull(in_plane.reshape(-1, 2)))


def girth_with_circle(outline: Cut, centre: FloatArray, radius: float) -> float:
    """Returns the length of a tape around a cut and a circle (2,) in its plane, m."""
    angle = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    circle = centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return _perimeter(_hull(np.vstack([outline.hull, circle])))


def _segments(
    vertices: FloatArray, height: FloatArray, faces: IndexArray
) -> tuple[FloatArray, IndexArray]:
    """Returns (k,2,3) where faces that cross the plane meet it, and (k,2) numbers of the edges."""
    above = height[faces] > 0.0
    # the vertex that is alone on its side of the plane, then the two others
    alone = np.where(above.sum(axis=1) == 1, np.argmax(above, axis=1), np.argmin(above, axis=1))
    rows = np.arange(len(faces))
    first = faces[rows, alone]
    places, edges = [], []
    for step in (1, 2):
        second = faces[rows, (alone + step) % 3]
        share = height[first] / (height[first] - height[second])
        places.append(vertices[first] + share[:, None] * (vertices[second] - vertices[first]))
        edges.append(np.minimum(first, second) * len(vertices) + np.maximum(first, second))
    return np.stack(places, axis=1), np.stack(edges, axis=1)


def plane_axes(normal: FloatArray) -> FloatArray:
    """Returns two unit vectors (2,3) in a plane; forward and left if it is horizontal."""
    ahead = np.array([1.0, 0.0, 0.0]) if abs(normal[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    first = ahead - (ahead @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def _hull(points: FloatArray) -> FloatArray:
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError as error:
        raise ValueError("the cut is a line") from error


def _perimeter(corners: FloatArray) -> float:
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).sum())
