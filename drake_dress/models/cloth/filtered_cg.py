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

from drake_dress.models.cloth.elements import LANES, Elements, FloatArray, IntArray
from drake_dress.models.cloth.factor.masked import Factor, solve_into
from drake_dress.models.cloth.filtered_stiffness import filtered_product
from drake_dress.models.cloth.matrices import Csr

FREE, STICK, SLIP, HELD = 0, 1, 2, 3


class SystemMatrix:
    """The matrix A of a step, linear ⊗ I₃ + scale · filtered stretch, and its solver.

    Args:
        linear: the scalar part.
        inverse_diagonal: (n,) of P, for nodes that the factor leaves out but contact does not.
        elements: the rest shape, or None if A has no filtered stretch.
        scale: of the filtered stretch, s².
    """

    def __init__(
        self,
        linear: Csr,
        inverse_diagonal: FloatArray,
        elements: Elements | None = None,
        scale: float = 0.0,
    ) -> None:
        if elements is None:
            triangle = np.zeros((0, 3, LANES), dtype=np.uint32)
            gradient, scale = np.zeros((0, 5, LANES)), 0.0
        else:
            triangle, gradient = elements.triangle_lanes, elements.gradient_lanes
        self._operator = (linear.indptr, linear.indices, linear.data, triangle, gradient)
        self._scale = scale
        self._inverse_diagonal = inverse_diagonal

    def product(self, z: FloatArray, block: FloatArray) -> FloatArray:
        """Returns A z (n,3); `block` is what `prepare_filtered` wrote for this state."""
        out = np.empty_like(z)
        _apply((*self._operator, block, self._scale), z, out)
        return out

    def solve(
        self,
        factor: Factor,
        block: FloatArray,
        mode: IntArray,
        normal: FloatArray,
        rhs: FloatArray,
        z: FloatArray,
        tolerance: float,
        max_iterations: int,
    ) -> tuple[int, float]:
        """Improves `z` (n,3) in place until ‖r‖ ≤ tolerance ‖Π rhs‖ in the preconditioner's norm.

        `z` holds the start: its free part is improved, its prescribed part (nodes that are held or
        stick, normal of those that slip) is kept, and enters the right-hand side through A. Nodes
        that `factor` leaves out and that are free here are preconditioned by the diagonal.

        Returns:
            Iterations done, and the last relative residual.
        """
        f = factor
        return _filtered_cg(
            (*self._operator, block, self._scale),
            (f.blocks, f.pattern.permutation),
            f.masked,
            self._inverse_diagonal,
            mode,
            normal,
            rhs,
            z,
            tolerance,
            max_iterations,
        )


@nb.njit(cache=True, nogil=True)
def _apply(operator, z, out):  # type: ignore[no-untyped-def]
    """Writes A z (n,3) into `out`."""
    indptr, indices, data, triangle, gradient, block, scale = operator
    matrix_product(indptr, indices, data, z, out)
    if scale != 0.0:
        filtered_product(z, triangle, gradient, block, scale, out)


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
def dot(a: FloatArray, b: FloatArray) -> float:
    """Returns Σ a b of two (k,3) arrays, summed in order."""
    s = 0.0
    for i in range(a.shape[0]):
        s += a[i, 0] * b[i, 0] + a[i, 1] * b[i, 1] + a[i, 2] * b[i, 2]
    return s


@nb.njit(cache=True, nogil=True)
def _filtered_cg(  # type: ignore[no-untyped-def]
    operator, factor, masked, masked_scale, mode, normal, rhs, z, tolerance, max_iterations
):
    n = rhs.shape[0]
    work = np.empty((n, 4))
    direction = np.empty((n, 3))
    product = np.empty((n, 3))
    preconditioned = np.empty((n, 3))
    preconditioner = (factor, masked, masked_scale, mode, normal, work)

    residual = rhs.copy()
    project(residual, mode, normal)
    _precondition(preconditioner, residual, preconditioned)
    floor = max(dot(residual, preconditioned), 1e-300)

    _apply(operator, z, residual)
    for i in range(n):
        for c in range(3):
            residual[i, c] = rhs[i, c] - residual[i, c]
    project(residual, mode, normal)
    _precondition(preconditioner, residual, preconditioned)
    rho = dot(residual, preconditioned)
    direction[:] = preconditioned
    iterations = 0
    while iterations < max_iterations and rho > tolerance * tolerance * floor:
        _apply(operator, direction, product)
        project(product, mode, normal)
        curvature = dot(direction, product)
        if curvature <= 0.0:
            break
        alpha = rho / curvature
        for i in range(n):
            for c in range(3):
                z[i, c] += alpha * direction[i, c]
                residual[i, c] -= alpha * product[i, c]
        _precondition(preconditioner, residual, preconditioned)
        new = dot(residual, preconditioned)
        beta = new / rho
        rho = new
        for i in range(n):
            for c in range(3):
                direction[i, c] = preconditioned[i, c] + beta * direction[i, c]
        iterations += 1
    return iterations, np.sqrt(max(rho, 0.0) / floor)


@nb.njit(cache=True, nogil=True)
def _precondition(preconditioner, residual, out):  # type: ignore[no-untyped-def]
    factor, masked, masked_scale, mode, normal, work = preconditioner
    blocks, permutation = factor
    solve_into(blocks, permutation, residual, out, work)
    for i in range(residual.shape[0]):
        if masked[i]:
            out[i, 0] = masked_scale[i] * residual[i, 0]
            out[i, 1] = masked_scale[i] * residual[i, 1]
            out[i, 2] = masked_scale[i] * residual[i, 2]
    project(out, mode, normal)
