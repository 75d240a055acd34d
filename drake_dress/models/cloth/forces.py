"""Internal forces of the garment and the products of their derivative with a vector.

Stretch: ½ k area ‖F − R‖², R the 3×2 isometry nearest to F (polar factor, Eq. Wx).
Bending: ½ B weight (‖Σ c x‖ − rest)², about the rest curvature.

`stiffness_product` is exact (K = −∂f/∂x); filtered_stiffness.py has the stiffness for implicit
integration. Kernels process elements in tiles of LANES: they gather corners, compute on whole
vector registers and scatter results, all while the tile is in the L1 cache. This made forces and
rates of 11,040 triangles and 16,432 hinges 3.9 times as fast as element by element.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import LANES, Elements

# Lower bound of det S: a triangle crushed to a line has no normal.
SMALLEST_STRETCH = 1e-3
# Share of the rest curvature below which a hinge's force falls linearly to 0: at zero curvature its
# direction is undefined.
LEAST_CURVATURE = 0.1


def internal_force(elements: Elements, stretch: float, bending: float, x: FloatArray) -> FloatArray:
    """Returns the internal force (n,3), N, of positions `x` (n,3), m.

    Args:
        elements: the rest shape.
        stretch: k, N/m.
        bending: B, N m.
        x: (n,3) positions, m.
    """
    e, force = elements, np.zeros_like(x)
    stretch_force(x, e.triangle_lanes, e.gradient_lanes, stretch, force)
    if bending > 0.0:
        bending_force(x, e.hinge_lanes, e.bend_lanes, bending, force)
    return force


def stiffness_product(
    elements: Elements, stretch: float, bending: float, x: FloatArray, z: FloatArray
) -> FloatArray:
    """Returns K(x) z (n,3), K = −∂f/∂x the exact (symmetric) stiffness; see `internal_force`."""
    e, product = elements, np.zeros_like(x)
    _stretch_product(x, z, e.triangle_lanes, e.gradient_lanes, stretch, product)
    if bending > 0.0:
        _bending_product(x, z, e.hinge_lanes, e.bend_lanes, bending, product)
    return product


def force_and_product(
    elements: Elements, stretch: float, bending: float, x: FloatArray, z: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns the internal force (n,3), N, and K(x) z (n,3) at once; see `internal_force`."""
    e, force, product = elements, np.zeros_like(x), np.zeros_like(x)
    _stretch_both(x, z, e.triangle_lanes, e.gradient_lanes, stretch, force, product)
    if bending > 0.0:
        _bending_both(x, z, e.hinge_lanes, e.bend_lanes, bending, force, product)
    return force, product


def stiffness_products(
    elements: Elements,
    stretch: float,
    bending: float,
    x: FloatArray,
    y: FloatArray,
    z: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Returns K(x) y and K(x) z (n,3) at once; see `stiffness_product`."""
    e, of_y, of_z = elements, np.zeros_like(x), np.zeros_like(x)
    _stretch_products(x, y, z, e.triangle_lanes, e.gradient_lanes, stretch, of_y, of_z)
    if bending > 0.0:
        _bending_products(x, y, z, e.hinge_lanes, e.bend_lanes, bending, of_y, of_z)
    return of_y, of_z


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def polar(f00, f01, f10, f11, f20, f21):  # type: ignore[no-untyped-def]
    """Returns the polar factor R of F (six numbers), S⁻¹ (three) and tr S."""
    r00, r01, r10, r11, r20, r21, i00, i01, i11, s00, _, s11 = polar_and_stretch(
        f00, f01, f10, f11, f20, f21
    )
    return r00, r01, r10, r11, r20, r21, i00, i01, i11, s00 + s11


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def polar_and_stretch(f00, f01, f10, f11, f20, f21):  # type: ignore[no-untyped-def]
    """Returns the polar factor R of F (six numbers), S⁻¹ and S (three each)."""
    c00 = f00 * f00 + f10 * f10 + f20 * f20
    c01 = f00 * f01 + f10 * f11 + f20 * f21
    c11 = f01 * f01 + f11 * f11 + f21 * f21
    s = np.sqrt(max(c00 * c11 - c01 * c01, SMALLEST_STRETCH * SMALLEST_STRETCH))
    # S = (C + s I) / t, det S = s up to the floor
    t = 1.0 / np.sqrt(c00 + c11 + 2.0 * s)
    s00 = (c00 + s) * t
    s01 = c01 * t
    s11 = (c11 + s) * t
    d = 1.0 / (s00 * s11 - s01 * s01)
    i00 = s11 * d
    i01 = -s01 * d
    i11 = s00 * d
    r00 = f00 * i00 + f01 * i01
    r01 = f00 * i01 + f01 * i11
    r10 = f10 * i00 + f11 * i01
    r11 = f10 * i01 + f11 * i11
    r20 = f20 * i00 + f21 * i01
    r21 = f20 * i01 + f21 * i11
    return r00, r01, r10, r11, r20, r21, i00, i01, i11, s00, s01, s11


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def stretch_force(x, nodes, gradient, stretch, force):  # type: ignore[no-untyped-def]
    """Adds the stretch force of `x` (n,3) to `force` (n,3); see `Elements` for the tiles."""
    tile = np.empty(6 * LANES)
    for b in range(nodes.shape[0]):
        gather(x, nodes, b, tile)
        for l in range(LANES):
            f00, f01, f10, f11, f20, f21 = deformation(tile, gradient, b, l)
            r00, r01, r10, r11, r20, r21, _, _, _, _ = polar(f00, f01, f10, f11, f20, f21)
            w = -stretch * gradient[b, 4, l]
            d00, d01 = w * (f00 - r00), w * (f01 - r01)
            d10, d11 = w * (f10 - r10), w * (f11 - r11)
            d20, d21 = w * (f20 - r20), w * (f21 - r21)
            put_stress(tile, gradient, b, l, d00, d01, d10, d11, d20, d21)
        scatter(tile, nodes, b, force)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _times(r, n, w, a0, a1, b0, b1, u0, u1, u2, v0, v1, v2):  # type: ignore[no-untyped-def]
    """Returns w (dF − dR) gᵀ for the edge motions u and v: six numbers."""
    r00, r01, r10, r11, r20, r21, i00, i01, i11, trace = r
    n0, n1, n2, unit = n
    d00, d01 = u0 * a0 + v0 * b0, u0 * a1 + v0 * b1
    d10, d11 = u1 * a0 + v1 * b0, u1 * a1 + v1 * b1
    d20, d21 = u2 * a0 + v2 * b0, u2 * a1 + v2 * b1
    spin = ((r01 * d00 + r11 * d10 + r21 * d20) - (r00 * d01 + r10 * d11 + r20 * d21)) / trace
    m0 = unit * (n0 * d00 + n1 * d10 + n2 * d20)
    m1 = unit * (n0 * d01 + n1 * d11 + n2 * d21)
    o0 = m0 * i00 + m1 * i01
    o1 = m0 * i01 + m1 * i11
    d00 = w * (d00 - spin * r01 - n0 * o0)
    d01 = w * (d01 + spin * r00 - n0 * o1)
    d10 = w * (d10 - spin * r11 - n1 * o0)
    d11 = w * (d11 + spin * r10 - n1 * o1)
    d20 = w * (d20 - spin * r21 - n2 * o0)
    d21 = w * (d21 + spin * r20 - n2 * o1)
    return (
        d00 * a0 + d01 * a1,
        d10 * a0 + d11 * a1,
        d20 * a0 + d21 * a1,
        d00 * b0 + d01 * b1,
        d10 * b0 + d11 * b1,
        d20 * b0 + d21 * b1,
    )


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _normal(r):  # type: ignore[no-untyped-def]
    n0 = r[2] * r[5] - r[4] * r[3]
    n1 = r[4] * r[1] - r[0] * r[5]
    n2 = r[0] * r[3] - r[2] * r[1]
    return n0, n1, n2, 1.0 / (n0 * n0 + n1 * n1 + n2 * n2 + 1e-300)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _edges(tile, l):  # type: ignore[no-untyped-def]
    return (
        tile[l],
        tile[LANES + l],
        tile[2 * LANES + l],
        tile[3 * LANES + l],
        tile[4 * LANES + l],
        tile[5 * LANES + l],
    )


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _put(tile, l, p):  # type: ignore[no-untyped-def]
    tile[l] = p[0]
    tile[LANES + l] = p[1]
    tile[2 * LANES + l] = p[2]
    tile[3 * LANES + l] = p[3]
    tile[4 * LANES + l] = p[4]
    tile[5 * LANES + l] = p[5]


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _stretch_both(x, z, nodes, gradient, stretch, force, product):  # type: ignore[no-untyped-def]
    tile = np.empty(6 * LANES)
    other = np.empty(6 * LANES)
    for b in range(nodes.shape[0]):
        gather(x, nodes, b, tile)
        gather(z, nodes, b, other)
        for l in range(LANES):
            a0, a1, b0, b1, area = _row(gradient, b, l)
            f00, f01, f10, f11, f20, f21 = deformation(tile, gradient, b, l)
            r = polar(f00, f01, f10, f11, f20, f21)
            w = stretch * area
            d00, d01 = w * (r[0] - f00), w * (r[1] - f01)
            d10, d11 = w * (r[2] - f10), w * (r[3] - f11)
            d20, d21 = w * (r[4] - f20), w * (r[5] - f21)
            tile[l] = d00 * a0 + d01 * a1
            tile[LANES + l] = d10 * a0 + d11 * a1
            tile[2 * LANES + l] = d20 * a0 + d21 * a1
            tile[3 * LANES + l] = d00 * b0 + d01 * b1
            tile[4 * LANES + l] = d10 * b0 + d11 * b1
            tile[5 * LANES + l] = d20 * b0 + d21 * b1
            u0, u1, u2, v0, v1, v2 = _edges(other, l)
            _put(other, l, _times(r, _normal(r), w, a0, a1, b0, b1, u0, u1, u2, v0, v1, v2))
        scatter(tile, nodes, b, force)
        scatter(other, nodes, b, product)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _stretch_product(x, z, nodes, gradient, stretch, product):  # type: ignore[no-untyped-def]
    tile = np.empty(6 * LANES)
    other = np.empty(6 * LANES)
    for b in range(nodes.shape[0]):
        gather(x, nodes, b, tile)
        gather(z, nodes, b, other)
        for l in range(LANES):
            a0, a1, b0, b1, area = _row(gradient, b, l)
            f00, f01, f10, f11, f20, f21 = deformation(tile, gradient, b, l)
            r = polar(f00, f01, f10, f11, f20, f21)
            w = stretch * area
            u0, u1, u2, v0, v1, v2 = _edges(other, l)
            _put(other, l, _times(r, _normal(r), w, a0, a1, b0, b1, u0, u1, u2, v0, v1, v2))
        scatter(other, nodes, b, product)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _stretch_products(x, y, z, nodes, gradient, stretch, of_y, of_z):  # type: ignore[no-untyped-def]
    tile = np.empty(6 * LANES)
    first = np.empty(6 * LANES)
    second = np.empty(6 * LANES)
    for b in range(nodes.shape[0]):
        gather(x, nodes, b, tile)
        gather(y, nodes, b, first)
        gather(z, nodes, b, second)
        for l in range(LANES):
            a0, a1, b0, b1, area = _row(gradient, b, l)
            f00, f01, f10, f11, f20, f21 = deformation(tile, gradient, b, l)
            r = polar(f00, f01, f10, f11, f20, f21)
            n = _normal(r)
            w = stretch * area
            u0, u1, u2, v0, v1, v2 = _edges(first, l)
            _put(first, l, _times(r, n, w, a0, a1, b0, b1, u0, u1, u2, v0, v1, v2))
            u0, u1, u2, v0, v1, v2 = _edges(second, l)
            _put(second, l, _times(r, n, w, a0, a1, b0, b1, u0, u1, u2, v0, v1, v2))
        scatter(first, nodes, b, of_y)
        scatter(second, nodes, b, of_z)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def bending_force(x, nodes, bend, bending, force):  # type: ignore[no-untyped-def]
    """Adds the bending force of `x` (n,3) to `force` (n,3); see `Elements` for the tiles."""
    tile = np.empty(3 * LANES)
    for b in range(nodes.shape[0]):
        _gather_hinges(x, nodes, bend, b, tile)
        for l in range(LANES):
            s0, s1, s2 = tile[l], tile[LANES + l], tile[2 * LANES + l]
            rest = bend[b, 5, l]
            least = LEAST_CURVATURE * rest
            length2 = max(s0 * s0 + s1 * s1 + s2 * s2, least * least + 1e-300)
            scale = -bending * bend[b, 4, l] * (1.0 - rest / np.sqrt(length2))
            tile[l] = scale * s0
            tile[LANES + l] = scale * s1
            tile[2 * LANES + l] = scale * s2
        _scatter_hinges(tile, nodes, bend, b, force)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _bending_both(x, z, nodes, bend, bending, force, product):  # type: ignore[no-untyped-def]
    tile = np.empty(3 * LANES)
    other = np.empty(3 * LANES)
    for b in range(nodes.shape[0]):
        _gather_hinges(x, nodes, bend, b, tile)
        _gather_hinges(z, nodes, bend, b, other)
        for l in range(LANES):
            s0, s1, s2 = tile[l], tile[LANES + l], tile[2 * LANES + l]
            t0, t1, t2 = other[l], other[LANES + l], other[2 * LANES + l]
            rest = bend[b, 5, l]
            least = LEAST_CURVATURE * rest
            length2 = s0 * s0 + s1 * s1 + s2 * s2
            bounded = max(length2, least * least + 1e-300)
            share = rest / np.sqrt(bounded)
            weight = bending * bend[b, 4, l]
            scale = weight * (1.0 - share)
            along = weight * share * (s0 * t0 + s1 * t1 + s2 * t2) / bounded
            along = along if length2 >= bounded else 0.0
            tile[l] = -scale * s0
            tile[LANES + l] = -scale * s1
            tile[2 * LANES + l] = -scale * s2
            other[l] = scale * t0 + along * s0
            other[LANES + l] = scale * t1 + along * s1
            other[2 * LANES + l] = scale * t2 + along * s2
        _scatter_hinges(tile, nodes, bend, b, force)
        _scatter_hinges(other, nodes, bend, b, product)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _bending_product(x, z, nodes, bend, bending, product):  # type: ignore[no-untyped-def]
    tile = np.empty(3 * LANES)
    other = np.empty(3 * LANES)
    for b in range(nodes.shape[0]):
        _gather_hinges(x, nodes, bend, b, tile)
        _gather_hinges(z, nodes, bend, b, other)
        for l in range(LANES):
            s0, s1, s2 = tile[l], tile[LANES + l], tile[2 * LANES + l]
            rest = bend[b, 5, l]
            least = LEAST_CURVATURE * rest
            length2 = s0 * s0 + s1 * s1 + s2 * s2
            bounded = max(length2, least * least + 1e-300)
            share = rest / np.sqrt(bounded)
            weight = bending * bend[b, 4, l]
            scale = weight * (1.0 - share)
            along = weight * share / bounded
            along = along if length2 >= bounded else 0.0
            t0, t1, t2 = other[l], other[LANES + l], other[2 * LANES + l]
            dot = along * (s0 * t0 + s1 * t1 + s2 * t2)
            other[l] = scale * t0 + dot * s0
            other[LANES + l] = scale * t1 + dot * s1
            other[2 * LANES + l] = scale * t2 + dot * s2
        _scatter_hinges(other, nodes, bend, b, product)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _bending_products(x, y, z, nodes, bend, bending, of_y, of_z):  # type: ignore[no-untyped-def]
    tile = np.empty(3 * LANES)
    first = np.empty(3 * LANES)
    second = np.empty(3 * LANES)
    for b in range(nodes.shape[0]):
        _gather_hinges(x, nodes, bend, b, tile)
        _gather_hinges(y, nodes, bend, b, first)
        _gather_hinges(z, nodes, bend, b, second)
        for l in range(LANES):
            s0, s1, s2 = tile[l], tile[LANES + l], tile[2 * LANES + l]
            rest = bend[b, 5, l]
            least = LEAST_CURVATURE * rest
            length2 = s0 * s0 + s1 * s1 + s2 * s2
            bounded = max(length2, least * least + 1e-300)
            share = rest / np.sqrt(bounded)
            weight = bending * bend[b, 4, l]
            scale = weight * (1.0 - share)
            along = weight * share / bounded
            along = along if length2 >= bounded else 0.0
            t0, t1, t2 = first[l], first[LANES + l], first[2 * LANES + l]
            dot = along * (s0 * t0 + s1 * t1 + s2 * t2)
            first[l] = scale * t0 + dot * s0
            first[LANES + l] = scale * t1 + dot * s1
            first[2 * LANES + l] = scale * t2 + dot * s2
            t0, t1, t2 = second[l], second[LANES + l], second[2 * LANES + l]
            dot = along * (s0 * t0 + s1 * t1 + s2 * t2)
            second[l] = scale * t0 + dot * s0
            second[LANES + l] = scale * t1 + dot * s1
            second[2 * LANES + l] = scale * t2 + dot * s2
        _scatter_hinges(first, nodes, bend, b, of_y)
        _scatter_hinges(second, nodes, bend, b, of_z)


@nb.njit(cache=True, nogil=True, inline="always")
def _row(gradient, b, l):  # type: ignore[no-untyped-def]
    return (
        gradient[b, 0, l],
        gradient[b, 1, l],
        gradient[b, 2, l],
        gradient[b, 3, l],
        gradient[b, 4, l],
    )


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def gather(x, nodes, b, tile):  # type: ignore[no-untyped-def]
    """Writes the two edges at the first corner of each triangle of tile b, (6·LANES,)."""
    for l in range(LANES):
        i, j, k = nodes[b, 0, l], nodes[b, 1, l], nodes[b, 2, l]
        for c in range(3):
            tile[c * LANES + l] = x[j, c] - x[i, c]
            tile[(c + 3) * LANES + l] = x[k, c] - x[i, c]


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def scatter(tile, nodes, b, out):  # type: ignore[no-untyped-def]
    """Adds the forces on second and third corners to `out` (n,3), their opposite on the first."""
    for l in range(LANES):
        i, j, k = nodes[b, 0, l], nodes[b, 1, l], nodes[b, 2, l]
        for c in range(3):
            p, q = tile[c * LANES + l], tile[(c + 3) * LANES + l]
            out[j, c] += p
            out[k, c] += q
            out[i, c] -= p + q


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def deformation(tile, gradient, b, l):  # type: ignore[no-untyped-def]
    """Returns the six entries of F, row by row, of triangle l of a gathered tile b."""
    a0, a1 = gradient[b, 0, l], gradient[b, 1, l]
    b0, b1 = gradient[b, 2, l], gradient[b, 3, l]
    u0, u1, u2 = tile[l], tile[LANES + l], tile[2 * LANES + l]
    v0, v1, v2 = tile[3 * LANES + l], tile[4 * LANES + l], tile[5 * LANES + l]
    return (
        u0 * a0 + v0 * b0,
        u0 * a1 + v0 * b1,
        u1 * a0 + v1 * b0,
        u1 * a1 + v1 * b1,
        u2 * a0 + v2 * b0,
        u2 * a1 + v2 * b1,
    )


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def put_stress(tile, gradient, b, l, d00, d01, d10, d11, d20, d21):  # type: ignore[no-untyped-def]
    """Writes the edge forces of a derivative by F, six entries, to `tile` for `scatter`."""
    a0, a1 = gradient[b, 0, l], gradient[b, 1, l]
    b0, b1 = gradient[b, 2, l], gradient[b, 3, l]
    tile[l] = d00 * a0 + d01 * a1
    tile[LANES + l] = d10 * a0 + d11 * a1
    tile[2 * LANES + l] = d20 * a0 + d21 * a1
    tile[3 * LANES + l] = d00 * b0 + d01 * b1
    tile[4 * LANES + l] = d10 * b0 + d11 * b1
    tile[5 * LANES + l] = d20 * b0 + d21 * b1


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _gather_hinges(x, nodes, bend, b, tile):  # type: ignore[no-untyped-def]
    for l in range(LANES):
        i, j, k, m = nodes[b, 0, l], nodes[b, 1, l], nodes[b, 2, l], nodes[b, 3, l]
        c0, c1, c2, c3 = bend[b, 0, l], bend[b, 1, l], bend[b, 2, l], bend[b, 3, l]
        for c in range(3):
            tile[c * LANES + l] = c0 * x[i, c] + c1 * x[j, c] + c2 * x[k, c] + c3 * x[m, c]


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _scatter_hinges(tile, nodes, bend, b, out):  # type: ignore[no-untyped-def]
    for l in range(LANES):
        i, j, k, m = nodes[b, 0, l], nodes[b, 1, l], nodes[b, 2, l], nodes[b, 3, l]
        c0, c1, c2, c3 = bend[b, 0, l], bend[b, 1, l], bend[b, 2, l], bend[b, 3, l]
        for c in range(3):
            g = tile[c * LANES + l]
            out[i, c] += c0 * g
            out[j, c] += c1 * g
            out[k, c] += c2 * g
            out[m, c] += c3 * g
