"""The positive semi-definite part K₊ of the stretch stiffness, which implicit schemes need.

Compressed directions lose their geometric stiffness (S⁻¹ is clamped to at most the identity);
directions under tension keep it. (The paper keeps only (I − BB†), which also drops the stiffening
by tension; treating that explicitly made a hanging coat flutter.) K₊ never exceeds Σ w AᵀA, so P
bounds M + h² K₊ from above.
"""

# The lanes of a vector register are written out, here as in the other law of stretch: a call
# between them would keep the compiler from using the registers.
# pylint: disable=duplicate-code

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import LANES, Elements
from drake_dress.models.cloth.forces import deformation, gather, polar, put_stress, scatter

# Rows per triangle in a block.
PLAIN_ROWS = 14
# Step of the finite differences in F, dimensionless.
_DIFFERENCE = 1e-7


def no_stretch() -> FloatArray:
    """Returns the data of zero triangles."""
    return np.zeros((0, PLAIN_ROWS, LANES))


def prepare_filtered(elements: Elements, stretch: float, x: FloatArray) -> FloatArray:
    """Returns the data of the triangles at `x` (n,3), m, for `filtered_product`: (⌈F/L⌉,14,L).

    Rows: R (6), its normal (3), k area S⁻¹ clamped to at most the identity (3),
    k area / max(tr S, 2) and k area.

    Args:
        elements: the rest shape.
        stretch: k, N/m.
        x: (n,3) positions, m.
    """
    block = np.empty((len(elements.triangle_lanes), PLAIN_ROWS, LANES))
    _prepare(x, elements.triangle_lanes, elements.gradient_lanes, stretch, block)
    return block


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _prepare(x, nodes, gradient, stretch, block):  # type: ignore[no-untyped-def]
    tile = np.empty(6 * LANES)
    # An array of known layout lets the compiler see that its rows do not overlap.
    rows = np.empty(PLAIN_ROWS * LANES)
    for b in range(nodes.shape[0]):
        gather(x, nodes, b, tile)
        for l in range(LANES):
            w = stretch * gradient[b, 4, l]
            f00, f01, f10, f11, f20, f21 = deformation(tile, gradient, b, l)
            r00, r01, r10, r11, r20, r21, i00, i01, i11, trace = polar(f00, f01, f10, f11, f20, f21)
            n0 = r10 * r21 - r20 * r11
            n1 = r20 * r01 - r00 * r21
            n2 = r00 * r11 - r10 * r01
            unit = 1.0 / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2 + 1e-300)
            # eigenvalues of S⁻¹ above 1 (compression) are clamped to 1
            mean = 0.5 * (i00 + i11)
            half = 0.5 * (i00 - i11)
            radius = np.sqrt(half * half + i01 * i01)
            high = min(mean + radius, 1.0)
            low = min(mean - radius, 1.0)
            mean = 0.5 * (high + low)
            shrink = 0.5 * (high - low) / max(radius, 1e-12)
            rows[l] = r00
            rows[LANES + l] = r01
            rows[2 * LANES + l] = r10
            rows[3 * LANES + l] = r11
            rows[4 * LANES + l] = r20
            rows[5 * LANES + l] = r21
            rows[6 * LANES + l] = unit * n0
            rows[7 * LANES + l] = unit * n1
            rows[8 * LANES + l] = unit * n2
            rows[9 * LANES + l] = w * (mean + shrink * half)
            rows[10 * LANES + l] = w * shrink * i01
            rows[11 * LANES + l] = w * (mean - shrink * half)
            rows[12 * LANES + l] = w / max(trace, 2.0)
            rows[13 * LANES + l] = w
        for c in range(PLAIN_ROWS):
            for l in range(LANES):
                block[b, c, l] = rows[c * LANES + l]


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", forceinline=True)
def filtered_product(z, nodes, gradient, block, scale, product):  # type: ignore[no-untyped-def]
    """Adds scale · K₊ z to `product` (n,3).

    Args:
        z: (n,3).
        nodes: `triangle_lanes` of the elements.
        gradient: `gradient_lanes` of the elements.
        block: result of `prepare_filtered`.
        scale: factor.
        product: (n,3), added to.
    """
    tile = np.empty(6 * LANES)
    for b in range(block.shape[0]):
        gather(z, nodes, b, tile)
        for l in range(LANES):
            d00, d01, d10, d11, d20, d21 = deformation(tile, gradient, b, l)
            r00, r01, r10 = block[b, 0, l], block[b, 1, l], block[b, 2, l]
            r11, r20, r21 = block[b, 3, l], block[b, 4, l], block[b, 5, l]
            n0, n1, n2 = block[b, 6, l], block[b, 7, l], block[b, 8, l]
            spin = block[b, 12, l] * (
                (r01 * d00 + r11 * d10 + r21 * d20) - (r00 * d01 + r10 * d11 + r20 * d21)
            )
            m0 = n0 * d00 + n1 * d10 + n2 * d20
            m1 = n0 * d01 + n1 * d11 + n2 * d21
            o0 = m0 * block[b, 9, l] + m1 * block[b, 10, l]
            o1 = m0 * block[b, 10, l] + m1 * block[b, 11, l]
            w = block[b, 13, l]
            d00 = scale * (w * d00 - spin * r01 - n0 * o0)
            d01 = scale * (w * d01 + spin * r00 - n0 * o1)
            d10 = scale * (w * d10 - spin * r11 - n1 * o0)
            d11 = scale * (w * d11 + spin * r10 - n1 * o1)
            d20 = scale * (w * d20 - spin * r21 - n2 * o0)
            d21 = scale * (w * d21 + spin * r20 - n2 * o1)
            put_stress(tile, gradient, b, l, d00, d01, d10, d11, d20, d21)
        scatter(tile, nodes, b, product)


def normal_response(
    elements: Elements, block: FloatArray, scale: float, diagonal: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns normals (n,3) of the nodes and 1 / (nᵀ A_ii n) (n,), 1/kg.

    A is `diagonal` ⊗ I₃ + scale · K₊ with its blocks A_ii. Along its normal, slack cloth has only
    mass and bending stiffness. P, which bounds stretch in all directions, is far too stiff there.

    Args:
        elements: the rest shape.
        block: result of `prepare_filtered`.
        scale: factor.
        diagonal: (n,) of the scalar part, kg.
    """
    normal = np.zeros((elements.node_count, 3))
    across = diagonal.copy()
    _across(block, elements.triangle_lanes, elements.gradient_lanes, scale, normal, across)
    return normal, 1.0 / across


@nb.njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")
def _across(block, nodes, gradient, scale, normal, across):  # type: ignore[no-untyped-def]
    for b in range(block.shape[0]):
        for l in range(LANES):
            for corner in range(3):
                i = nodes[b, corner, l]
                for c in range(3):
                    normal[i, c] += block[b, 13, l] * block[b, 6 + c, l]
    for i in range(normal.shape[0]):
        size2 = normal[i, 0] ** 2 + normal[i, 1] ** 2 + normal[i, 2] ** 2
        if size2 > 0.0:
            for c in range(3):
                normal[i, c] /= np.sqrt(size2)
    for b in range(block.shape[0]):
        for l in range(LANES):
            w = block[b, 13, l]
            if w == 0.0:
                continue
            for corner in range(3):
                if corner == 0:
                    g0 = -gradient[b, 0, l] - gradient[b, 2, l]
                    g1 = -gradient[b, 1, l] - gradient[b, 3, l]
                else:
                    g0, g1 = gradient[b, 2 * corner - 2, l], gradient[b, 2 * corner - 1, l]
                i = nodes[b, corner, l]
                along0, along1, up = 0.0, 0.0, 0.0
                for c in range(3):
                    along0 += normal[i, c] * block[b, 2 * c, l]
                    along1 += normal[i, c] * block[b, 2 * c + 1, l]
                    up += normal[i, c] * block[b, 6 + c, l]
                turned = along1 * g0 - along0 * g1
                cut = g0 * g0 * block[b, 9, l] + 2.0 * g0 * g1 * block[b, 10, l]
                cut += g1 * g1 * block[b, 11, l]
                stiff = w * (g0 * g0 + g1 * g1) - block[b, 12, l] * turned**2 - up**2 * cut
                across[i] += scale * max(stiff, 0.0)


def filtered_derivative(
    elements: Elements, stretch: float, x: FloatArray, w: FloatArray, z: FloatArray
) -> FloatArray:
    """Returns ∂(wᵀ K₊(x) z)/∂x (n,3).

    K₊ is not a Hessian, so this is not a product with a third derivative. It is computed per
    triangle by central differences in the six entries of F, which are accurate to about 1e-9.

    Args:
        elements: the rest shape.
        stretch: k, N/m.
        x: (n,3) positions, m.
        w: (n,3).
        z: (n,3).
    """
    out = np.zeros_like(x)
    _derivative(x, w, z, elements.triangle_lanes, elements.gradient_lanes, stretch, out)
    return out


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _derivative(x, w, z, nodes, gradient, stretch, out):  # type: ignore[no-untyped-def]
    tile = np.empty(6 * LANES)
    f = np.empty(6 * LANES)
    dw = np.empty(6 * LANES)
    dz = np.empty(6 * LANES)
    slope = np.empty(6 * LANES)
    value = np.empty(LANES)
    for b in range(nodes.shape[0]):
        gather(x, nodes, b, tile)
        _to_gradient(tile, gradient, b, f)
        gather(w, nodes, b, tile)
        _to_gradient(tile, gradient, b, dw)
        gather(z, nodes, b, tile)
        _to_gradient(tile, gradient, b, dz)
        for c in range(6):
            for l in range(LANES):
                f[c * LANES + l] += _DIFFERENCE
            _quadratic(f, dw, dz, gradient, b, stretch, value)
            for l in range(LANES):
                slope[c * LANES + l] = value[l]
                f[c * LANES + l] -= 2.0 * _DIFFERENCE
            _quadratic(f, dw, dz, gradient, b, stretch, value)
            for l in range(LANES):
                slope[c * LANES + l] = (slope[c * LANES + l] - value[l]) / (2.0 * _DIFFERENCE)
                f[c * LANES + l] += _DIFFERENCE
        for l in range(LANES):
            a0, a1, b0, b1 = (
                gradient[b, 0, l],
                gradient[b, 1, l],
                gradient[b, 2, l],
                gradient[b, 3, l],
            )
            for c in range(3):
                g0, g1 = slope[2 * c * LANES + l], slope[(2 * c + 1) * LANES + l]
                tile[c * LANES + l] = g0 * a0 + g1 * a1
                tile[(c + 3) * LANES + l] = g0 * b0 + g1 * b1
        scatter(tile, nodes, b, out)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", forceinline=True)
def _to_gradient(tile, gradient, b, f):  # type: ignore[no-untyped-def]
    """Writes the gradients F (rows of x, y, z) of the edges in `tile` to `f` (6·LANES,)."""
    for l in range(LANES):
        a0, a1, b0, b1 = gradient[b, 0, l], gradient[b, 1, l], gradient[b, 2, l], gradient[b, 3, l]
        for c in range(3):
            u, v = tile[c * LANES + l], tile[(c + 3) * LANES + l]
            f[2 * c * LANES + l] = u * a0 + v * b0
            f[(2 * c + 1) * LANES + l] = u * a1 + v * b1


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", forceinline=True)
def _quadratic(f, dw, dz, gradient, b, stretch, value):  # type: ignore[no-untyped-def]
    """Writes dwᵀ k₊(F) dz of the triangles of tile b to `value` (LANES,)."""
    for l in range(LANES):
        r00, r01, r10, r11, r20, r21, i00, i01, i11, trace = polar(
            f[l],
            f[LANES + l],
            f[2 * LANES + l],
            f[3 * LANES + l],
            f[4 * LANES + l],
            f[5 * LANES + l],
        )
        n0 = r10 * r21 - r20 * r11
        n1 = r20 * r01 - r00 * r21
        n2 = r00 * r11 - r10 * r01
        unit = 1.0 / (n0 * n0 + n1 * n1 + n2 * n2 + 1e-300)
        mean = 0.5 * (i00 + i11)
        half = 0.5 * (i00 - i11)
        radius = np.sqrt(half * half + i01 * i01)
        high = min(mean + radius, 1.0)
        low = min(mean - radius, 1.0)
        mean = 0.5 * (high + low)
        shrink = 0.5 * (high - low) / max(radius, 1e-12)
        w00, w01 = dw[l], dw[LANES + l]
        w10, w11 = dw[2 * LANES + l], dw[3 * LANES + l]
        w20, w21 = dw[4 * LANES + l], dw[5 * LANES + l]
        z00, z01 = dz[l], dz[LANES + l]
        z10, z11 = dz[2 * LANES + l], dz[3 * LANES + l]
        z20, z21 = dz[4 * LANES + l], dz[5 * LANES + l]
        spin_w = (r01 * w00 + r11 * w10 + r21 * w20) - (r00 * w01 + r10 * w11 + r20 * w21)
        spin_z = (r01 * z00 + r11 * z10 + r21 * z20) - (r00 * z01 + r10 * z11 + r20 * z21)
        m0 = n0 * w00 + n1 * w10 + n2 * w20
        m1 = n0 * w01 + n1 * w11 + n2 * w21
        o0 = n0 * z00 + n1 * z10 + n2 * z20
        o1 = n0 * z01 + n1 * z11 + n2 * z21
        normal = (
            m0 * o0 * (mean + shrink * half)
            + (m0 * o1 + m1 * o0) * shrink * i01
            + m1 * o1 * (mean - shrink * half)
        )
        full = w00 * z00 + w01 * z01 + w10 * z10 + w11 * z11 + w20 * z20 + w21 * z21
        k = stretch * gradient[b, 4, l]
        value[l] = k * (full - spin_w * spin_z / max(trace, 2.0) - unit * normal)
