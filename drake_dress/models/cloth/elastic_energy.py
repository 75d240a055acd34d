"""The elastic energy, for line searches; `forces.internal_force` is minus its gradient.

Stretch: ½ k area ‖F − R‖² = ½ k area (tr C − 2 tr S + 2), with C = FᵀF = S². Only C is needed, no
polar factor. Bending: ½ B weight (‖Σ c x‖ − rest)².
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.forces import LEAST_CURVATURE, SMALLEST_STRETCH


def elastic_energy(elements: Elements, stretch: float, bending: float, x: FloatArray) -> float:
    """Returns the energy, J, of positions `x` (n,3), m.

    Exact except for triangles crushed to a thousandth of their area, whose force is bounded.

    Args:
        elements: the rest shape.
        stretch: k, N/m.
        bending: B, N m.
        x: (n,3) positions, m.
    """
    e = elements
    energy = _stretch(x, e.triangle, e.triangle_gradient, e.triangle_area, stretch)
    if bending > 0.0:
        energy += _bending(x, e.hinge, e.hinge_coefficient, e.hinge_weight, e.hinge_rest, bending)
    return float(energy)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _stretch(x, triangle, gradient, area, stretch):  # type: ignore[no-untyped-def]
    total = 0.0
    for e in range(triangle.shape[0]):
        i, j, k = triangle[e, 0], triangle[e, 1], triangle[e, 2]
        a0, a1 = gradient[e, 1, 0], gradient[e, 1, 1]
        b0, b1 = gradient[e, 2, 0], gradient[e, 2, 1]
        c00 = c01 = c11 = 0.0
        for c in range(3):
            u = x[j, c] - x[i, c]
            v = x[k, c] - x[i, c]
            p = u * a0 + v * b0
            q = u * a1 + v * b1
            c00 += p * p
            c01 += p * q
            c11 += q * q
        s = np.sqrt(max(c00 * c11 - c01 * c01, SMALLEST_STRETCH * SMALLEST_STRETCH))
        trace = c00 + c11
        total += area[e] * (trace - 2.0 * np.sqrt(trace + 2.0 * s) + 2.0)
    return 0.5 * stretch * total


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _bending(x, hinge, coefficient, weight, rest, bending):  # type: ignore[no-untyped-def]
    total = 0.0
    for e in range(hinge.shape[0]):
        length2 = 0.0
        for c in range(3):
            s = 0.0
            for m in range(4):
                s += coefficient[e, m] * x[hinge[e, m], c]
            length2 += s * s
        length = np.sqrt(length2)
        if length >= LEAST_CURVATURE * rest[e]:
            total += weight[e] * (length - rest[e]) ** 2
        else:
            total += weight[e] * (
                (1.0 - LEAST_CURVATURE) * rest[e] ** 2 + (1.0 - 1.0 / LEAST_CURVATURE) * length2
            )
    return 0.5 * bending * total
