"""Conjugate gradients on the motions that contact leaves free.

A node is free (three directions), slips (two directions, none along its normal) or has a
prescribed motion (none). With Π the projection on what is free, the solver finds z in the range
of Π with Π A z = Π rhs, A = scalar matrix ⊗ I₃ (+ scale · filtered stretch of the elements), by
preconditioned conjugate gradients with a masked factor of P (Baraff and Witkin 1998, with a
preconditioner that knows the garment). A factor from a slightly different set of nodes is still
symmetric positive definite between the projections, so it need not be renewed at every step.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.cloth.elements import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.factor import solve_into
from drake_dress.models.cloth.forces import filtered_product

FREE, STICK, SLIP, HELD = 0, 1, 2, 3


@nb.njit(cache=True, nogil=True)
def matrix_product(
    indptr: IntArray, indices: IntArray, data: FloatArray, z: FloatArray, out: FloatArray
) -> None:
    """Writes (matrix ⊗ I₃) z, (n,3), into `out` for a CSR matrix."""
    for i in range(z.shape[0]):
        a = 0.0
        b = 0.0
        c = 0.0
        for q in range(indptr[i], indptr[i + 1]):
            j = indices[q]
            v = data[q]
            a += v * z[j, 0]
            b += v * z[j, 1]
            c += v * z[j, 2]
        out[i, 0] = a
        out[i, 1] = b
        out[i, 2] = c


@nb.njit(cache=True, nogil=True)
def project(z: FloatArray, mode: IntArray, normal: FloatArray) -> None:
    """Removes from `z` (n,3), in place, what the modes do not leave free."""
    for i in range(z.shape[0]):
        m = mode[i]
        if m == 1 or m == 3:
            z[i, 0] = 0.0
            z[i, 1] = 0.0
            z[i, 2] = 0.0
        elif m == 2:
            d = z[i, 0] * normal[i, 0] + z[i, 1] * normal[i, 1] + z[i, 2] * normal[i, 2]
            z[i, 0] -= d * normal[i, 0]
            z[i, 1] -= d * normal[i, 1]
            z[i, 2] -= d * normal[i, 2]


@nb.njit(cache=True, nogil=True)
def _dot(a: FloatArray, b: FloatArray) -> float:
    s = 0.0
    for i in range(a.shape[0]):
        s += a[i, 0] * b[i, 0] + a[i, 1] * b[i, 1] + a[i, 2] * b[i, 2]
    return s


@nb.njit(cache=True, nogil=True)
def filtered_cg(
    indptr: IntArray,
    indices: IntArray,
    data: FloatArray,
    triangle: IntArray,
    gradient: FloatArray,
    block: FloatArray,
    scale: float,
    column_start: IntArray,
    column_end: IntArray,
    row: IntArray,
    value: FloatArray,
    inverse_diagonal: FloatArray,
    permutation: IntArray,
    masked: BoolArray,
    masked_scale: FloatArray,
    mode: IntArray,
    normal: FloatArray,
    rhs: FloatArray,
    z: FloatArray,
    tolerance: float,
    max_iterations: int,
) -> tuple[int, float]:
    """Improves `z` (n,3) in place until ‖r‖ ≤ tolerance ‖Π rhs‖ in the preconditioner's norm.

    `z` holds the start: its free part is improved, its prescribed part (nodes that are held or
    stick, normal of those that slip) is kept, and enters the right-hand side through A. Masked
    nodes of the factor that are free here are preconditioned by `masked_scale` (n,), the inverse
    diagonal. With `scale` = 0 the elements are not used.

    Returns:
        Iterations done, and the last relative residual.
    """
    n = rhs.shape[0]
    residual = np.empty((n, 3))
    matrix_product(indptr, indices, data, z, residual)
    if scale != 0.0:
        filtered_product(z, triangle, gradient, block, scale, residual)
    reference = rhs.copy()
    for i in range(n):
        for c in range(3):
            residual[i, c] = rhs[i, c] - residual[i, c]
    project(residual, mode, normal)
    project(reference, mode, normal)
    work = np.empty((n, 3))
    direction = np.empty((n, 3))
    product = np.empty((n, 3))
    preconditioned = np.empty((n, 3))

    _precondition(
        column_start,
        column_end,
        row,
        value,
        inverse_diagonal,
        permutation,
        masked,
        masked_scale,
        mode,
        normal,
        reference,
        preconditioned,
        work,
    )
    floor = _dot(reference, preconditioned)
    _precondition(
        column_start,
        column_end,
        row,
        value,
        inverse_diagonal,
        permutation,
        masked,
        masked_scale,
        mode,
        normal,
        residual,
        preconditioned,
        work,
    )
    rho = _dot(residual, preconditioned)
    floor = max(floor, 1e-300)
    direction[:] = preconditioned
    iterations = 0
    while iterations < max_iterations and rho > tolerance * tolerance * floor:
        matrix_product(indptr, indices, data, direction, product)
        if scale != 0.0:
            filtered_product(direction, triangle, gradient, block, scale, product)
        project(product, mode, normal)
        curvature = _dot(direction, product)
        if curvature <= 0.0:
            break
        alpha = rho / curvature
        for i in range(n):
            for c in range(3):
                z[i, c] += alpha * direction[i, c]
                residual[i, c] -= alpha * product[i, c]
        _precondition(
            column_start,
            column_end,
            row,
            value,
            inverse_diagonal,
            permutation,
            masked,
            masked_scale,
            mode,
            normal,
            residual,
            preconditioned,
            work,
        )
        new = _dot(residual, preconditioned)
        beta = new / rho
        rho = new
        for i in range(n):
            for c in range(3):
                direction[i, c] = preconditioned[i, c] + beta * direction[i, c]
        iterations += 1
    return iterations, np.sqrt(max(rho, 0.0) / floor)


@nb.njit(cache=True, nogil=True)
def _precondition(  # type: ignore[no-untyped-def]
    column_start,
    column_end,
    row,
    value,
    inverse_diagonal,
    permutation,
    masked,
    masked_scale,
    mode,
    normal,
    residual,
    out,
    work,
):
    solve_into(
        column_start,
        column_end,
        row,
        value,
        inverse_diagonal,
        permutation,
        masked,
        residual,
        out,
        work,
    )
    for i in range(residual.shape[0]):
        if masked[i]:
            out[i, 0] = masked_scale[i] * residual[i, 0]
            out[i, 1] = masked_scale[i] * residual[i, 1]
            out[i, 2] = masked_scale[i] * residual[i, 2]
    project(out, mode, normal)
