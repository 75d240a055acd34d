"""Farthest-point sampling of a garment."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray


def spread_out(points: FloatArray, count: int, first: int) -> IndexArray:
    """Returns indices of `count` points (all if there are fewer) by farthest-point sampling.

    Args:
        points: (n,3) m.
        count: number of points to select.
        first: index of the first point.
    """
    chosen = [first]
    distance = np.linalg.norm(points - points[first], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)
