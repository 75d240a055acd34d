"""Tells whether points are inside a mesh that may have holes, by its winding number.

Source: Jacobson, Kavan and Sorkine-Hornung 2013; the solid angle of a triangle: van Oosterom and
Strackee 1983.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray


def winding_numbers(points: FloatArray, vertices: FloatArray, faces: IndexArray) -> FloatArray:
    """Returns how often a mesh winds around each point (k,): 1 inside a closed one, 0 outside.

    Args:
        points: (k,3).
        vertices: (n,3).
        faces: (F,3), counter-clockwise from outside; otherwise the number is negative.
    """
    return np.array([_solid_angle(vertices[faces] - p) for p in points]) / (4.0 * np.pi)


def _solid_angle(corners: FloatArray) -> float:
    """Returns the sum of the solid angles of triangles (F,3,3) seen from the origin."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = (np.einsum("ij,ij->i", x, y) for x, y in ((a, b), (b, c), (c, a)))
    ab, bc, ca = dots
    return float(2.0 * np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb).sum())
