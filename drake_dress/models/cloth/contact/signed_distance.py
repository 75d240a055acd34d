"""What a closed mesh is to contact: samples of its signed distance; made in `solid.py`.

It stands by itself since a process that steps a garment needs it, and none of what makes it.
"""

from __future__ import annotations

from dataclasses import dataclass

from drake_dress.models.arrays import FloatArray


@dataclass(frozen=True)
class SignedDistanceField:
    """Signed distance to a closed surface in its body's frame, positive outside, m.

    Attributes:
        origin: (3,) position of the grid's first node, m.
        spacing: of the grid, m.
        coefficients: (i,j,k) of the cubic B-spline.
    """

    origin: FloatArray
    spacing: float
    coefficients: FloatArray
