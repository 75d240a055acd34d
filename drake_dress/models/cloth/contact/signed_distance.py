"""Samples of the signed distance of a closed mesh, for contact; made in `solid.py`.

The class has its own module because a process that steps a garment needs it, but not the imports of
`solid.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

from drake_dress.models.arrays import FloatArray


@dataclass(frozen=True)
class SignedDistanceField:
    """Signed distance to a closed surface in its body's frame, positive outside, m.

    Attributes:
        origin: (3,) position of the grid's first node, m.
        spacing: spacing of the grid, m.
        coefficients: (i,j,k) coefficients of the cubic B-spline.
    """

    origin: FloatArray
    spacing: float
    coefficients: FloatArray
