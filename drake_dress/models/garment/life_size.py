"""The size of a garment beside that of people, and the unit that it tells."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.sides import SIDES

# Units of files, m, by how common they are.
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048, "dm": 0.1}
AUTO = "auto"
DIAGONAL_RANGE, JACKET = (0.5, 3.0), 1.25  # of a garment's bounding box, and of a jacket's, m
# Distance between the tops of the armholes, m: from a toddler's shirt to a very wide coat, and of
# garments for most adults. People's shoulders are 0.22 m (two years) to 0.46 m wide (a large man)
# from tip to tip, and garments up to half as much wider.
_SHOULDERS, ADULT = (0.2, 0.7), 0.44


def units_that_fit(diagonal: float) -> list[str]:
    """Returns the units in which a bounding box of this diagonal can be a garment's."""
    low, high = DIAGONAL_RANGE
    return [name for name, factor in UNITS.items() if low <= diagonal * factor <= high]


def check_diagonal(diagonal: float, unit: str, scale: float, source: str) -> None:
    """Checks that a garment is neither a doll's nor a giant's.

    Args:
        diagonal: of its bounding box in units of the file, times the scale.
        unit: one of `UNITS`.
        scale: factor on all coordinates, in addition to the unit.
        source: file put in front of messages.

    Raises:
        UserError: the diagonal is out of range. The message says what would fit.
    """
    better = units_that_fit(diagonal)
    if unit in better:
        return
    low, high = DIAGONAL_RANGE
    like = f"{scale * JACKET / diagonal / UNITS[unit]:.2g}"
    hint = (
        f"with {better[0]} it would fit"
        if better
        else f"no unit fits, with garment.mesh.scale: {like} it would be as large as a jacket"
    )
    raise UserError(
        source,
        "unit",
        f"in {unit} the garment's bounding box has a diagonal of {diagonal * UNITS[unit]:.3g} m, "
        f"expected {low} to {high} m (wrong unit?); {hint}",
    )


def shoulder_width(position: FloatArray, loops: Mapping[str, IntArray]) -> float:
    """Returns the distance between the highest nodes of the armholes, m.

    Args:
        position: (n,3) with z up, m.
        loops: with both armholes.
    """
    tips = []
    for side in SIDES:
        around = position[loops[f"{side}_armhole"]]
        tips.append(around[np.argmax(around[:, 2])])
    return float(np.linalg.norm(tips[0] - tips[1]))


def check_life_size(width: float, scale: float, source: str) -> None:
    """Checks that a garment's shoulders are a person's.

    Args:
        width: of the shoulders, m.
        scale: factor that was applied in addition to the unit.
        source: file put in front of messages.

    Raises:
        UserError: they are not.
    """
    if not is_life_size(width):
        low, high = _SHOULDERS
        raise UserError(
            source,
            "scale",
            f"is {scale:g}, with which the shoulders are {width:.2f} m wide, expected {low} to "
            f"{high} m; {scale * ADULT / width:.2g} would fit most adults",
        )


def is_life_size(width: float) -> bool:
    """Returns whether shoulders of this width, m, are a person's."""
    low, high = _SHOULDERS
    return low <= width <= high


def from_adult(width: float) -> float:
    """Returns how far shoulders of this width, m, are from an adult's, from 0."""
    return abs(float(np.log(width / ADULT)))
