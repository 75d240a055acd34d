"""Compression limit for meshes too coarse for the wrinkles that cloth would have.

A compressed strip buckles at Euler's load, B (2π/λ)² for a wave of length λ. A mesh cannot form
waves shorter than a few of its spacings, so it bears loads that cloth would not: at 2 cm spacing a
coat's grippers felt a quarter more force than at 1 cm, at 3 cm up to three times as much. Principal
compressions therefore bear, per width, little more than the load of the mesh's shortest wave,

    σ = k e                              e = σ_i − 1 > −e_c,   e_c = B (2π/λ)² / k,
    σ = −k e_c + AFTER k (e + e_c)       beyond,

with λ a number of spacings. On fine meshes compression never reaches e_c and the law equals that of
`forces`; the limit only changes how fast results converge to that. (Tension-field theory, Pipkin
1986, "The relaxed energy density for isotropic elastic membranes", has e_c = 0.)
"""

# The lanes of a vector register are written out, here as in the other law of stretch: a call
# between them would keep the compiler from using the registers.
# pylint: disable=duplicate-code

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import LANES, Elements, in_lanes
from drake_dress.models.cloth.filtered_stiffness import PLAIN_ROWS
from drake_dress.models.cloth.forces import (
    deformation,
    gather,
    polar_and_stretch,
    put_stress,
    scatter,
)
from drake_dress.models.cloth.material import Material

# Stiffness beyond e_c, as a share of k. A buckled strip bears hardly more than its buckling load
# (elastica), but with zero stiffness triangles would collapse.
_AFTER = 0.02
# Rows of `Buckling.prepare`: those of `prepare_filtered`, and five more.
BUCKLED_ROWS = PLAIN_ROWS + 5
# Difference below which principal stretches count as equal.
_ALIKE = 1e-9


class Buckling:
    """Stretch force and stiffness of a garment with limited compression.

    Args:
        elements: the rest shape.
        material: its stretch and bending stiffness.
        wavelength: λ, in spacings of the mesh; above 0.
    """

    def __init__(self, elements: Elements, material: Material, wavelength: float) -> None:
        self._stretch = material.stretch_stiffness
        self._limit = in_lanes(buckling_strain(elements, material, wavelength)[:, None])

    def force(self, elements: Elements, x: FloatArray) -> FloatArray:
        """Returns the stretch force (n,3), N, at positions `x` (n,3), m.

        Args:
            elements: those of the constructor; their areas may be scaled.
            x: (n,3) positions, m.
        """
        e, force = elements, np.zeros_like(x)
        _force(x, e.triangle_lanes, e.gradient_lanes, self._limit, self._stretch, force)
        return force

    def prepare(self, elements: Elements, x: FloatArray) -> FloatArray:
        """Returns the data for products with the positive semi-definite stiffness, (⌈F/L⌉,19,L).

        The rows of `prepare_filtered`, followed by: k area less the stiffness along the larger and
        the smaller principal stretch, and in shear between them; cosine and sine of twice the angle
        of the larger stretch.
        """
        block = np.empty((len(elements.triangle_lanes), BUCKLED_ROWS, LANES))
        e = elements
        _prepare(x, e.triangle_lanes, e.gradient_lanes, self._limit, self._stretch, block)
        return block


def buckling_strain(elements: Elements, material: Material, wavelength: float) -> FloatArray:
    """Returns e_c (F,) of the triangles, with the spacing of a grid of right triangles."""
    wave = wavelength * np.sqrt(2.0 * elements.triangle_area)
    load = material.bending_stiffness * (2.0 * np.pi / wave) ** 2
    strain: FloatArray = load / material.stretch_stiffness
    return strain


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _tension(s00, s01, s11, limit):  # type: ignore[no-untyped-def]
    """Returns both principal strains, both tensions over k, and the mean of the stretches."""
    mean = 0.5 * (s00 + s11)
    half = 0.5 * (s00 - s11)
    radius = np.sqrt(half * half + s01 * s01)
    e1 = mean + radius - 1.0
    e2 = mean - radius - 1.0
    p1 = max(e1, _AFTER * (e1 + limit) - limit)
    p2 = max(e2, _AFTER * (e2 + limit) - limit)
    return e1, e2, p1, p2, mean


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _force(x, nodes, gradient, limit, stretch, force):  # type: ignore[no-untyped-def]
    tile = np.empty(6 * LANES)
    for b in range(nodes.shape[0]):
        gather(x, nodes, b, tile)
        for l in range(LANES):
            f00, f01, f10, f11, f20, f21 = deformation(tile, gradient, b, l)
            r00, r01, r10, r11, r20, r21, _, _, _, s00, s01, s11 = polar_and_stretch(
                f00, f01, f10, f11, f20, f21
            )
            e1, e2, p1, p2, mean = _tension(s00, s01, s11, limit[b, 0, l])
            # the tension has the principal axes of S
            w = -stretch * gradient[b, 4, l]
            slope = w * (p1 - p2) / max(e1 - e2, _ALIKE)
            level = w * 0.5 * (p1 + p2)
            t00 = level + slope * (s00 - mean)
            t01 = slope * s01
            t11 = level + slope * (s11 - mean)
            d00, d01 = r00 * t00 + r01 * t01, r00 * t01 + r01 * t11
            d10, d11 = r10 * t00 + r11 * t01, r10 * t01 + r11 * t11
            d20, d21 = r20 * t00 + r21 * t01, r20 * t01 + r21 * t11
            put_stress(tile, gradient, b, l, d00, d01, d10, d11, d20, d21)
        scatter(tile, nodes, b, force)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _prepare(x, nodes, gradient, limit, stretch, block):  # type: ignore[no-untyped-def]
    tile = np.empty(6 * LANES)
    # An array of known layout lets the compiler see that its rows do not overlap.
    rows = np.empty(BUCKLED_ROWS * LANES)
    for b in range(nodes.shape[0]):
        gather(x, nodes, b, tile)
        for l in range(LANES):
            w = stretch * gradient[b, 4, l]
            f00, f01, f10, f11, f20, f21 = deformation(tile, gradient, b, l)
            r00, r01, r10, r11, r20, r21, _, _, _, s00, s01, s11 = polar_and_stretch(
                f00, f01, f10, f11, f20, f21
            )
            n0 = r10 * r21 - r20 * r11
            n1 = r20 * r01 - r00 * r21
            n2 = r00 * r11 - r10 * r01
            unit = 1.0 / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2 + 1e-300)
            most = limit[b, 0, l]
            e1, e2, p1, p2, mean = _tension(s00, s01, s11, most)
            apart = e1 - e2
            # cosine and sine of twice the angle of the larger stretch
            c = (s00 - s11) / max(apart, _ALIKE)
            s = 2.0 * s01 / max(apart, _ALIKE)
            k1 = 1.0 if e1 > -most else _AFTER
            k2 = 1.0 if e2 > -most else _AFTER
            shear = (p1 - p2) / apart if apart > _ALIKE else k1
            spin = max(0.5 * (p1 + p2) / mean, 0.0)
            # along the normal, tension provides stiffness and compression none
            q1 = 1.0 - max(p1, 0.0) / (1.0 + max(e1, 0.0))
            q2 = 1.0 - max(p2, 0.0) / (1.0 + max(e2, 0.0))
            middle = 0.5 * (q1 + q2)
            half = 0.5 * (q1 - q2)
            rows[l] = r00
            rows[LANES + l] = r01
            rows[2 * LANES + l] = r10
            rows[3 * LANES + l] = r11
            rows[4 * LANES + l] = r20
            rows[5 * LANES + l] = r21
            rows[6 * LANES + l] = unit * n0
            rows[7 * LANES + l] = unit * n1
            rows[8 * LANES + l] = unit * n2
            rows[9 * LANES + l] = w * (middle + half * c)
            rows[10 * LANES + l] = w * half * s
            rows[11 * LANES + l] = w * (middle - half * c)
            rows[12 * LANES + l] = 0.5 * w * (1.0 - spin)
            rows[13 * LANES + l] = w
            rows[14 * LANES + l] = w * (1.0 - k1)
            rows[15 * LANES + l] = w * (1.0 - k2)
            rows[16 * LANES + l] = w * (1.0 - shear)
            rows[17 * LANES + l] = c
            rows[18 * LANES + l] = s
        for c in range(BUCKLED_ROWS):
            for l in range(LANES):
                block[b, c, l] = rows[c * LANES + l]


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", forceinline=True)
def buckled_product(z, nodes, gradient, block, scale, product):  # type: ignore[no-untyped-def]
    """Adds scale · K₊ z to `product`, like `filtered_product`; `block` of `Buckling.prepare`."""
    tile = np.empty(6 * LANES)
    for b in range(block.shape[0]):
        gather(z, nodes, b, tile)
        for l in range(LANES):
            d00, d01, d10, d11, d20, d21 = deformation(tile, gradient, b, l)
            r00, r01, r10 = block[b, 0, l], block[b, 1, l], block[b, 2, l]
            r11, r20, r21 = block[b, 3, l], block[b, 4, l], block[b, 5, l]
            n0, n1, n2 = block[b, 6, l], block[b, 7, l], block[b, 8, l]
            # G = Rᵀ dF, in the plane: strain and rotation
            g01 = r00 * d01 + r10 * d11 + r20 * d21
            g10 = r01 * d00 + r11 * d10 + r21 * d20
            spin = block[b, 12, l] * (g10 - g01)
            e00 = r00 * d00 + r10 * d10 + r20 * d20
            e11 = r01 * d01 + r11 * d11 + r21 * d21
            c, s = block[b, 17, l], block[b, 18, l]
            mean, half, turn = 0.5 * (e00 + e11), 0.5 * (e00 - e11), 0.5 * (g10 + g01)
            along = half * c + turn * s
            t1 = block[b, 14, l] * (mean + along)
            t2 = block[b, 15, l] * (mean - along)
            t3 = block[b, 16, l] * (turn * c - half * s)
            middle, apart = 0.5 * (t1 + t2), 0.5 * (t1 - t2)
            q00 = middle + apart * c - t3 * s
            q11 = middle - apart * c + t3 * s
            q01 = apart * s + t3 * c
            # the stiffness missing from w dF, in the plane and along the normal
            h00, h01, h10, h11 = q00, q01 - spin, q01 + spin, q11
            m0 = n0 * d00 + n1 * d10 + n2 * d20
            m1 = n0 * d01 + n1 * d11 + n2 * d21
            o0 = m0 * block[b, 9, l] + m1 * block[b, 10, l]
            o1 = m0 * block[b, 10, l] + m1 * block[b, 11, l]
            w = block[b, 13, l]
            d00 = scale * (w * d00 - r00 * h00 - r01 * h10 - n0 * o0)
            d01 = scale * (w * d01 - r00 * h01 - r01 * h11 - n0 * o1)
            d10 = scale * (w * d10 - r10 * h00 - r11 * h10 - n1 * o0)
            d11 = scale * (w * d11 - r10 * h01 - r11 * h11 - n1 * o1)
            d20 = scale * (w * d20 - r20 * h00 - r21 * h10 - n2 * o0)
            d21 = scale * (w * d21 - r20 * h01 - r21 * h11 - n2 * o1)
            put_stress(tile, gradient, b, l, d00, d01, d10, d11, d20, d21)
        scatter(tile, nodes, b, product)
