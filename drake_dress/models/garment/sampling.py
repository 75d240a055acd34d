"""Points of a garment that are far from each other."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray


def spread_out(points: FloatArray, count: int, first: int) -> IndexArray:
    """Returns indices of `count` points (n,3), all if fewer: each the farthest from those before.

    Args:
        points: (n,3) m.
        count: wanted.
        first: index to begin with.
    """
    chosen = [first]
    distance = np.linalg.norm(points - points[first], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)
