"""Names the usual mistake behind impossible coordinates: units, axes, or sides.

A remedy undoes one mistake. If it makes the points possible, that was the mistake.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from drake_dress.models.arrays import FloatArray

# Undoes a mistake in points (m,3).
Remedy = Callable[[FloatArray], FloatArray]

_UNITS = {"in metres": 1.0, "in mm": 1e-3, "in cm": 1e-2, "in inches": 0.0254, "in feet": 0.3048}
# Columns of a message, with sign, that are x, y, z of the world, by what is wrong with the message.
_AXES = {
    "": (1, 2, 3),
    "y up": (1, -3, 2),
    "y up and z ahead": (3, 1, 2),
    "y up and z behind": (-3, -1, 2),
    "y up, left-handed": (1, 3, 2),
    "z down": (1, -2, -3),
    "x to the right": (2, -1, 3),
    "mirrored left and right": (1, -2, 3),
    "mirrored front and back": (-1, 2, 3),
    "turned by 180°": (-1, -2, 3),
}


def _arranged(axes: Sequence[int], scale: float) -> Remedy:
    columns = np.abs(axes) - 1
    factors = scale * np.sign(axes)
    return lambda points: points[:, columns] * factors


# A unit alone first, then axes alone, then both.
COORDINATES: dict[str, Remedy] = {
    ", ".join(word for word in (unit if scale != 1.0 or not axes else "", axes) if word): _arranged(
        columns, scale
    )
    for axes, columns in _AXES.items()
    for unit, scale in _UNITS.items()
    if axes or scale != 1.0
}


def mistake(
    points: FloatArray,
    possible: Callable[[FloatArray], bool],
    remedies: dict[str, Remedy],
) -> str | None:
    """Returns the name of the first remedy that makes points possible; None if none does.

    Args:
        points: (m,3) as received, finite.
        possible: tells whether points are possible.
        remedies: by the name of the mistake that they undo.
    """
    return next((name for name, undo in remedies.items() if possible(undo(points))), None)
