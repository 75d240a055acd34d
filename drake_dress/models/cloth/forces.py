"""Internal forces of the garment and the products of their derivative with a vector.

Stretch: ½ k area ‖F − R‖², R the 3×2 isometry nearest to F (polar factor, Eq. Wx).
Bending: ½ B weight (‖Σ c x‖ − rest)², about the rest curvature.

`stiffness_product` is exact (−∂f/∂x). `prepare_filtered` and `filtered_product` give the positive
semi-definite part that implicit integration needs: compressed directions keep no geometric
stiffness. (The paper keeps (I − BB†) only; that drops the stiffening by tension as well, which
left explicit made a hanging coat flutter.)
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.cloth.elements import Elements, FloatArray, IntArray

# Smallest value a singular value of S is divided by: a triangle crushed to a line has no normal.
_SMALLEST_STRETCH = 1e-3


def internal_force(elements: Elements, stretch: float, bending: float, x: FloatArray) -> FloatArray:
    """Returns the internal force (n,3), N, of positions `x` (n,3), m.

    Args:
        elements: the rest shape.
        stretch: k, N/m.
        bending: B, N m.
        x: (n,3) positions, m.
    """
    e, force = elements, np.empty_like(x)
    _internal_force(
        x,
        e.triangle,
        e.triangle_gradient,
        e.triangle_area,
        stretch,
        e.hinge,
        e.hinge_coefficient,
        e.hinge_weight,
        e.hinge_rest,
        bending,
        force,
    )
    return force


def stiffness_product(
    elements: Elements, stretch: float, bending: float, x: FloatArray, z: FloatArray
) -> FloatArray:
    """Returns K(x) z (n,3), K = −∂f/∂x the exact (symmetric) stiffness; see `internal_force`."""
    e, product = elements, np.empty_like(x)
    _stiffness_product(
        x,
        z,
        e.triangle,
        e.triangle_gradient,
        e.triangle_area,
        stretch,
        e.hinge,
        e.hinge_coefficient,
        e.hinge_weight,
        e.hinge_rest,
        bending,
        product,
    )
    return product


@nb.njit(cache=True, nogil=True, fastmath=False)
def _polar(f00, f01, f10, f11, f20, f21):  # type: ignore[no-untyped-def]
    """Returns the polar factor (six numbers), S⁻¹ (three), tr S and the unit normal (three)."""
    c00 = f00 * f00 + f10 * f10 + f20 * f20
    c01 = f00 * f01 + f10 * f11 + f20 * f21
    c11 = f01 * f01 + f11 * f11 + f21 * f21
    det = c00 * c11 - c01 * c01
    s = np.sqrt(max(det, _SMALLEST_STRETCH * _SMALLEST_STRETCH))
    t = np.sqrt(c00 + c11 + 2.0 * s)
    # S = (C + s I) / t, det S = s up to the floor
    s00 = (c00 + s) / t
    s01 = c01 / t
    s11 = (c11 + s) / t
    d = s00 * s11 - s01 * s01
    i00 = s11 / d
    i01 = -s01 / d
    i11 = s00 / d
    r00 = f00 * i00 + f01 * i01
    r01 = f00 * i01 + f01 * i11
    r10 = f10 * i00 + f11 * i01
    r11 = f10 * i01 + f11 * i11
    r20 = f20 * i00 + f21 * i01
    r21 = f20 * i01 + f21 * i11
    n0 = r10 * r21 - r20 * r11
    n1 = r20 * r01 - r00 * r21
    n2 = r00 * r11 - r10 * r01
    norm = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    if norm > 0.0:
        n0 /= norm
        n1 /= norm
        n2 /= norm
    return r00, r01, r10, r11, r20, r21, i00, i01, i11, s00 + s11, n0, n1, n2


@nb.njit(cache=True, nogil=True)
def _internal_force(
    x: FloatArray,
    triangle: IntArray,
    gradient: FloatArray,
    area: FloatArray,
    stretch: float,
    hinge: IntArray,
    coefficient: FloatArray,
    weight: FloatArray,
    rest: FloatArray,
    bending: float,
    force: FloatArray,
) -> None:
    force[:] = 0.0
    for e in range(triangle.shape[0]):
        i, j, k = triangle[e, 0], triangle[e, 1], triangle[e, 2]
        a0, a1 = gradient[e, 1, 0], gradient[e, 1, 1]
        b0, b1 = gradient[e, 2, 0], gradient[e, 2, 1]
        u0, u1, u2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        v0, v1, v2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        f00, f01 = u0 * a0 + v0 * b0, u0 * a1 + v0 * b1
        f10, f11 = u1 * a0 + v1 * b0, u1 * a1 + v1 * b1
        f20, f21 = u2 * a0 + v2 * b0, u2 * a1 + v2 * b1
        r00, r01, r10, r11, r20, r21, _, _, _, _, _, _, _ = _polar(f00, f01, f10, f11, f20, f21)
        w = stretch * area[e]
        d00, d01 = w * (f00 - r00), w * (f01 - r01)
        d10, d11 = w * (f10 - r10), w * (f11 - r11)
        d20, d21 = w * (f20 - r20), w * (f21 - r21)
        p0, p1, p2 = d00 * a0 + d01 * a1, d10 * a0 + d11 * a1, d20 * a0 + d21 * a1
        q0, q1, q2 = d00 * b0 + d01 * b1, d10 * b0 + d11 * b1, d20 * b0 + d21 * b1
        force[j, 0] -= p0
        force[j, 1] -= p1
        force[j, 2] -= p2
        force[k, 0] -= q0
        force[k, 1] -= q1
        force[k, 2] -= q2
        force[i, 0] += p0 + q0
        force[i, 1] += p1 + q1
        force[i, 2] += p2 + q2
    if bending > 0.0:
        for e in range(hinge.shape[0]):
            s0 = 0.0
            s1 = 0.0
            s2 = 0.0
            for m in range(4):
                c = coefficient[e, m]
                s0 += c * x[hinge[e, m], 0]
                s1 += c * x[hinge[e, m], 1]
                s2 += c * x[hinge[e, m], 2]
            length = np.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
            scale = -bending * weight[e]
            if rest[e] > 0.0:
                scale *= 1.0 - rest[e] / max(length, 0.1 * rest[e])
            for m in range(4):
                c = scale * coefficient[e, m]
                force[hinge[e, m], 0] += c * s0
                force[hinge[e, m], 1] += c * s1
                force[hinge[e, m], 2] += c * s2


@nb.njit(cache=True, nogil=True)
def _stiffness_product(
    x: FloatArray,
    z: FloatArray,
    triangle: IntArray,
    gradient: FloatArray,
    area: FloatArray,
    stretch: float,
    hinge: IntArray,
    coefficient: FloatArray,
    weight: FloatArray,
    rest: FloatArray,
    bending: float,
    product: FloatArray,
) -> None:
    product[:] = 0.0
    for e in range(triangle.shape[0]):
        i, j, k = triangle[e, 0], triangle[e, 1], triangle[e, 2]
        a0, a1 = gradient[e, 1, 0], gradient[e, 1, 1]
        b0, b1 = gradient[e, 2, 0], gradient[e, 2, 1]
        u0, u1, u2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        v0, v1, v2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        f00, f01 = u0 * a0 + v0 * b0, u0 * a1 + v0 * b1
        f10, f11 = u1 * a0 + v1 * b0, u1 * a1 + v1 * b1
        f20, f21 = u2 * a0 + v2 * b0, u2 * a1 + v2 * b1
        r00, r01, r10, r11, r20, r21, i00, i01, i11, trace, n0, n1, n2 = _polar(
            f00, f01, f10, f11, f20, f21
        )
        u0, u1, u2 = z[j, 0] - z[i, 0], z[j, 1] - z[i, 1], z[j, 2] - z[i, 2]
        v0, v1, v2 = z[k, 0] - z[i, 0], z[k, 1] - z[i, 1], z[k, 2] - z[i, 2]
        d00, d01 = u0 * a0 + v0 * b0, u0 * a1 + v0 * b1
        d10, d11 = u1 * a0 + v1 * b0, u1 * a1 + v1 * b1
        d20, d21 = u2 * a0 + v2 * b0, u2 * a1 + v2 * b1
        spin = ((r01 * d00 + r11 * d10 + r21 * d20) - (r00 * d01 + r10 * d11 + r20 * d21)) / trace
        m0 = n0 * d00 + n1 * d10 + n2 * d20
        m1 = n0 * d01 + n1 * d11 + n2 * d21
        o0 = m0 * i00 + m1 * i01
        o1 = m0 * i01 + m1 * i11
        w = stretch * area[e]
        d00 = w * (d00 - spin * r01 - n0 * o0)
        d01 = w * (d01 + spin * r00 - n0 * o1)
        d10 = w * (d10 - spin * r11 - n1 * o0)
        d11 = w * (d11 + spin * r10 - n1 * o1)
        d20 = w * (d20 - spin * r21 - n2 * o0)
        d21 = w * (d21 + spin * r20 - n2 * o1)
        p0, p1, p2 = d00 * a0 + d01 * a1, d10 * a0 + d11 * a1, d20 * a0 + d21 * a1
        q0, q1, q2 = d00 * b0 + d01 * b1, d10 * b0 + d11 * b1, d20 * b0 + d21 * b1
        product[j, 0] += p0
        product[j, 1] += p1
        product[j, 2] += p2
        product[k, 0] += q0
        product[k, 1] += q1
        product[k, 2] += q2
        product[i, 0] -= p0 + q0
        product[i, 1] -= p1 + q1
        product[i, 2] -= p2 + q2
    if bending > 0.0:
        for e in range(hinge.shape[0]):
            s0 = 0.0
            s1 = 0.0
            s2 = 0.0
            t0 = 0.0
            t1 = 0.0
            t2 = 0.0
            for m in range(4):
                c = coefficient[e, m]
                s0 += c * x[hinge[e, m], 0]
                s1 += c * x[hinge[e, m], 1]
                s2 += c * x[hinge[e, m], 2]
                t0 += c * z[hinge[e, m], 0]
                t1 += c * z[hinge[e, m], 1]
                t2 += c * z[hinge[e, m], 2]
            base = 1.0
            along = 0.0
            if rest[e] > 0.0:
                length = np.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
                if length > 0.1 * rest[e]:
                    base = 1.0 - rest[e] / length
                    along = rest[e] / length**3 * (s0 * t0 + s1 * t1 + s2 * t2)
                else:
                    base = -9.0
            for m in range(4):
                c = bending * weight[e] * coefficient[e, m]
                product[hinge[e, m], 0] += c * (base * t0 + along * s0)
                product[hinge[e, m], 1] += c * (base * t1 + along * s1)
                product[hinge[e, m], 2] += c * (base * t2 + along * s2)


@nb.njit(cache=True, nogil=True)
def prepare_filtered(
    x: FloatArray,
    triangle: IntArray,
    gradient: FloatArray,
    area: FloatArray,
    stretch: float,
    block: FloatArray,
) -> None:
    """Writes what `filtered_product` needs of each triangle, (F,12), into `block`.

    R (6), normal (3), then S⁻¹ clamped to at most the identity (3); the in-plane spin factor
    1 / max(tr S, 2) is folded into R's scale by storing it apart: see `filtered_product`.
    """
    for e in range(triangle.shape[0]):
        i, j, k = triangle[e, 0], triangle[e, 1], triangle[e, 2]
        a0, a1 = gradient[e, 1, 0], gradient[e, 1, 1]
        b0, b1 = gradient[e, 2, 0], gradient[e, 2, 1]
        u0, u1, u2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        v0, v1, v2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        f00, f01 = u0 * a0 + v0 * b0, u0 * a1 + v0 * b1
        f10, f11 = u1 * a0 + v1 * b0, u1 * a1 + v1 * b1
        f20, f21 = u2 * a0 + v2 * b0, u2 * a1 + v2 * b1
        r00, r01, r10, r11, r20, r21, i00, i01, i11, trace, n0, n1, n2 = _polar(
            f00, f01, f10, f11, f20, f21
        )
        # eigenvalues of S⁻¹ above 1 (compression) are cut to 1
        mean = 0.5 * (i00 + i11)
        half = 0.5 * (i00 - i11)
        radius = np.sqrt(half * half + i01 * i01)
        high, low = mean + radius, mean - radius
        if low >= 1.0:
            i00, i01, i11 = 1.0, 0.0, 1.0
        elif high > 1.0 and radius > 1e-12:
            cut = (high - 1.0) / (2.0 * radius)
            i00 -= cut * (radius + half)
            i11 -= cut * (radius - half)
            i01 -= cut * i01
        w = stretch * area[e]
        block[e, 0] = r00
        block[e, 1] = r01
        block[e, 2] = r10
        block[e, 3] = r11
        block[e, 4] = r20
        block[e, 5] = r21
        block[e, 6] = n0
        block[e, 7] = n1
        block[e, 8] = n2
        block[e, 9] = w * i00
        block[e, 10] = w * i01
        block[e, 11] = w * i11
        block[e, 12] = w / max(trace, 2.0)
        block[e, 13] = w


@nb.njit(cache=True, nogil=True)
def filtered_product(
    z: FloatArray,
    triangle: IntArray,
    gradient: FloatArray,
    block: FloatArray,
    scale: float,
    product: FloatArray,
) -> None:
    """Adds scale · K₊ z (stretch only, positive semi-definite) to `product` (n,3)."""
    for e in range(triangle.shape[0]):
        i, j, k = triangle[e, 0], triangle[e, 1], triangle[e, 2]
        a0, a1 = gradient[e, 1, 0], gradient[e, 1, 1]
        b0, b1 = gradient[e, 2, 0], gradient[e, 2, 1]
        u0, u1, u2 = z[j, 0] - z[i, 0], z[j, 1] - z[i, 1], z[j, 2] - z[i, 2]
        v0, v1, v2 = z[k, 0] - z[i, 0], z[k, 1] - z[i, 1], z[k, 2] - z[i, 2]
        d00, d01 = u0 * a0 + v0 * b0, u0 * a1 + v0 * b1
        d10, d11 = u1 * a0 + v1 * b0, u1 * a1 + v1 * b1
        d20, d21 = u2 * a0 + v2 * b0, u2 * a1 + v2 * b1
        r00, r01, r10 = block[e, 0], block[e, 1], block[e, 2]
        r11, r20, r21 = block[e, 3], block[e, 4], block[e, 5]
        n0, n1, n2 = block[e, 6], block[e, 7], block[e, 8]
        spin = block[e, 12] * (
            (r01 * d00 + r11 * d10 + r21 * d20) - (r00 * d01 + r10 * d11 + r20 * d21)
        )
        m0 = n0 * d00 + n1 * d10 + n2 * d20
        m1 = n0 * d01 + n1 * d11 + n2 * d21
        o0 = m0 * block[e, 9] + m1 * block[e, 10]
        o1 = m0 * block[e, 10] + m1 * block[e, 11]
        w = block[e, 13]
        d00 = scale * (w * d00 - spin * r01 - n0 * o0)
        d01 = scale * (w * d01 + spin * r00 - n0 * o1)
        d10 = scale * (w * d10 - spin * r11 - n1 * o0)
        d11 = scale * (w * d11 + spin * r10 - n1 * o1)
        d20 = scale * (w * d20 - spin * r21 - n2 * o0)
        d21 = scale * (w * d21 + spin * r20 - n2 * o1)
        p0, p1, p2 = d00 * a0 + d01 * a1, d10 * a0 + d11 * a1, d20 * a0 + d21 * a1
        q0, q1, q2 = d00 * b0 + d01 * b1, d10 * b0 + d11 * b1, d20 * b0 + d21 * b1
        product[j, 0] += p0
        product[j, 1] += p1
        product[j, 2] += p2
        product[k, 0] += q0
        product[k, 1] += q1
        product[k, 2] += q2
        product[i, 0] -= p0 + q0
        product[i, 1] -= p1 + q1
        product[i, 2] -= p2 + q2
