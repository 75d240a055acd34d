"""Rotations about a coordinate axis."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray


def rotation_about(axis: str, angle: float) -> FloatArray:
    """Returns the rotation (3,3) by `angle`, rad, about `x`, `y` or `z`."""
    c, s = np.cos(angle), np.sin(angle)
    if axis == "x":
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]], dtype=np.float64)
    if axis == "y":
        return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]], dtype=np.float64)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], dtype=np.float64)
