"""Axis conventions of garment files."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray

# Rows are the garment's forward, left and up directions in the file's axes. A garment with z up
# faces +x; with y up it faces +z (as garment programs export it); with x up it faces +y. A minus
# sign turns the garment upside down about its forward direction.
AXES: dict[str, FloatArray] = {
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    "y": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "x": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "-z": np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]),
    "-y": np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
    "-x": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]]),
}


def turned(position: FloatArray, up: str) -> FloatArray:
    """Returns (n,3) positions with +x forward, +y left and +z up.

    Args:
        position: (n,3) in the file's axes.
        up: the file's axis that points up, a key of `AXES`.
    """
    return np.asarray(position @ AXES[up].T)
