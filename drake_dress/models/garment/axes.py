"""Axis conventions of garment files."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray

AXES = ("z", "y", "x", "-z", "-y", "-x")
# The axis that a garment faces by default, by the axis that points up. With y up it faces z, as
# garment programs export it. A minus sign turns the garment upside down about this direction.
_FACING = {"z": "x", "y": "z", "x": "y", "-z": "x", "-y": "z", "-x": "y"}


def facings(up: str) -> tuple[str, ...]:
    """Returns the axes that a garment can face with the axis `up` upward, the default first."""
    first = _FACING[up]
    return (first, *(axis for axis in AXES if axis != first and axis[-1] != up[-1]))


def orientation(up: str, facing: str | None = None) -> FloatArray:
    """Returns (3,3) whose rows are the garment's forward, left and up directions in a file's axes.

    Args:
        up: the file's axis that points up, one of `AXES`.
        facing: the file's axis that the garment faces, one of `facings(up)`; None for the first.
    """
    above, ahead = _direction(up), _direction(facing or _FACING[up])
    return np.stack([ahead, np.cross(above, ahead), above])


def turned(position: FloatArray, up: str, facing: str | None = None) -> FloatArray:
    """Returns (n,3) positions with +x forward, +y left and +z up.

    Args:
        position: (n,3) in the file's axes.
        up: see `orientation`.
        facing: see `orientation`.
    """
    return np.asarray(position @ orientation(up, facing).T)


def _direction(axis: str) -> FloatArray:
    direction = np.zeros(3)
    direction["xyz".index(axis[-1])] = -1.0 if axis[0] == "-" else 1.0
    return direction
