"""Where the garment is about to touch something: at nodes, edge midpoints and face centroids.

An edge or face that comes too close lends its depth to its nodes: if all nodes of the element
move out by that depth, so does the point. So contact stays a matter of nodes, and a thin hand
cannot slip between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.cloth.contact.distance import nearest_obstacle, pack, surface_frame
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import FloatArray, IntArray


@dataclass(frozen=True)
class Proximity:
    """The nodes against the nearest obstacle.

    Attributes:
        gap: (n,) distance less the margin, m; negative where the margin is entered.
        owner: (n,) nearest obstacle, -1 without any.
        normal: (n,3) outward unit; slope: (n,) such that the gap's gradient is slope · normal.
        surface_velocity: (n,3) m/s.
    """

    gap: FloatArray
    owner: IntArray
    normal: FloatArray
    slope: FloatArray
    surface_velocity: FloatArray


def find_proximity(
    x: FloatArray,
    obstacles: Obstacles,
    margin: float,
    edge: IntArray | None = None,
    triangle: IntArray | None = None,
) -> Proximity:
    """Returns the gap of each node of `x` (n,3), with edges (E,2) and faces (F,3) where given."""
    n = len(x)
    shapes = pack(obstacles)
    gap = np.empty(n)
    owner = np.empty(n, dtype=np.int32)
    nearest_obstacle(x, shapes, gap, owner)
    if obstacles.count and edge is not None and triangle is not None:
        lent = gap.copy()
        # Only elements within their own size of a surface can enter it.
        _lend_depth(x, edge, shapes, gap, lent)
        _lend_depth(x, triangle, shapes, gap, lent)
        gap = lent
    normal = np.empty((n, 3))
    slope = np.empty(n)
    velocity = np.empty((n, 3))
    twist = obstacles.twists()
    surface_frame(x, shapes, obstacles.origins(), *twist, owner, normal, slope, velocity)
    return Proximity(gap - margin, owner, normal, slope, velocity)


@nb.njit(cache=True, nogil=True)
def _lend_depth(x, element, shapes, distance, lent):  # type: ignore[no-untyped-def]
    corners = element.shape[1]
    point = np.empty((1, 3))
    depth = np.empty(1)
    who = np.empty(1, dtype=np.int32)
    for e in range(element.shape[0]):
        least = 1e9
        for c in range(corners):
            least = min(least, distance[element[e, c]])
        i, j = element[e, 0], element[e, 1]
        size2 = (x[i, 0] - x[j, 0]) ** 2 + (x[i, 1] - x[j, 1]) ** 2 + (x[i, 2] - x[j, 2]) ** 2
        if least > 0.0 and least * least > size2:
            continue
        point[:] = 0.0
        for c in range(corners):
            for k in range(3):
                point[0, k] += x[element[e, c], k] / corners
        nearest_obstacle(point, shapes, depth, who)
        for c in range(corners):
            node = element[e, c]
            if depth[0] < lent[node]:
                lent[node] = depth[0]
