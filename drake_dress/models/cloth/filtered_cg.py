"""Conjugate gradients on the motions that contact leaves free.

A node is free (three directions), slips (two, none along its normal), moves along a rail (one) or
has a prescribed motion (none). With Π the projection onto the free directions, the solver finds z
with Π A z = Π rhs, A = scalar matrix ⊗ I₃ (+ scale · filtered stretch of the elements), by
preconditioned conjugate gradients with a masked factor of P (Baraff and Witkin 1998, with a
garment-specific preconditioner). A factor made for a slightly different set of nodes is still
symmetric positive definite between the projections, so it need not be renewed at every step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.buckling import BUCKLED_ROWS, buckled_product
from drake_dress.models.cloth.elements import LANES, Elements
from drake_dress.models.cloth.factor.kernels import row_product
from drake_dress.models.cloth.factor.masked import Factor, solve_pair_into, solve_rows
from drake_dress.models.cloth.fibres import Fibres, no_fibres
from drake_dress.models.cloth.fibres import filtered_product as fibre_product
from drake_dress.models.cloth.filtered_stiffness import filtered_product
from drake_dress.models.cloth.layers.bonds import NO_BONDS, Bonds, bond_product
from drake_dress.models.cloth.matrices import Csr
from drake_dress.models.cloth.vectors import add, dot, turn

# Weight of the response along the normal beside P⁻¹ in the preconditioner. It is below 1 because
# both contain smooth motion.
_ACROSS = 0.3
# Share of the initial residual that rounding leaves. If almost nothing drives the free part, the
# tolerance lies below this, and further iterations would only change noise.
_ROUNDING = 1e-12
# The residual also need not fall below this share of the tolerance relative to its initial value:
# without motion and weight there is no other reference for it.
_OF_THE_START = 1e-2


@dataclass(frozen=True)
class Preconditioner:
    """Approximation of the inverse of A.

    Attributes:
        factor: factor of P that leaves some nodes out. The free ones among them are preconditioned
            by the diagonal.
        across: result of `normal_response`, added to the preconditioner but not to the norm. A
            coat on an arm took 16.5 iterations without it, and 12.5 with it.
    """

    factor: Factor
    across: tuple[FloatArray, FloatArray] | None = None


@dataclass(frozen=True)
class Bound:
    """Prescribed part of the nodes' motion.

    Attributes:
        mode: (n,) FREE, STICK, SLIP, HELD or RAIL.
        normal: (n,3) surface normal where a node slips, or direction of its rail.
        resistance: (n,) added to the diagonal of A where nodes are free, kg.
    """

    mode: IntArray
    normal: FloatArray
    resistance: FloatArray | None = None


@dataclass(frozen=True)
class Stop:
    """Stopping criteria of conjugate gradients.

    Attributes:
        tolerance: residual relative to ‖Π against‖.
        max_iterations: upper limit of iterations.
        against: (n,3) reference of the residual; the right-hand side by default.
    """

    tolerance: float
    max_iterations: int
    against: FloatArray | None = None


class SystemMatrix:
    """The matrix A of a step, linear ⊗ I₃ + scale · filtered stretch, and its solver.

    Args:
        linear: the scalar part.
        inverse_diagonal: (n,) of P, for nodes that the factor leaves out but contact does not.
        elements: the rest shape, or None if A has no filtered stretch.
        scale: factor of the filtered stretch, s².
        fibres: additional stretch along one direction per triangle; call `prepare_fibres` before a
            product.
    """

    def __init__(
        self,
        linear: Csr,
        inverse_diagonal: FloatArray,
        elements: Elements | None = None,
        scale: float = 0.0,
        fibres: Fibres | None = None,
    ) -> None:
        if elements is None:
            triangle = np.zeros((0, 3, LANES), dtype=np.uint32)
            gradient, scale = np.zeros((0, 5, LANES)), 0.0
        else:
            triangle, gradient = elements.triangle_lanes, elements.gradient_lanes
        f = fibres or no_fibres()
        self._fibres = f
        self._fibre_block = np.zeros((0, 4))
        self._bonds = NO_BONDS
        # a copy: `set_diagonal` changes it
        self._linear = (linear.indptr, linear.indices, linear.data.copy())
        row = np.repeat(np.arange(len(linear.indptr) - 1), np.diff(linear.indptr))
        self._diagonal = np.flatnonzero(row == linear.indices)
        self._elements = (triangle, gradient, f.triangle, f.coefficient, f.weight)
        self._scale = scale
        self._inverse_diagonal = inverse_diagonal

    def set_diagonal(self, diagonal: FloatArray) -> None:
        """Replaces the diagonal of the scalar part by `diagonal` (n,)."""
        self._linear[2][self._diagonal] = diagonal

    def set_bonds(self, bonds: Bonds) -> None:
        """Replaces the pairs of layers that resist approach."""
        self._bonds = bonds

    def prepare_fibres(self, x: FloatArray) -> None:
        """Computes the fibres' directions at positions `x` (n,3), m."""
        self._fibre_block = self._fibres.prepare(x)

    def _operator(self, block: FloatArray) -> tuple[object, ...]:
        b = self._bonds
        bonds = (b.node, b.row, b.resistance)
        return (*self._linear, *self._elements, self._fibre_block, block, self._scale, bonds)

    def product(self, z: FloatArray, block: FloatArray) -> FloatArray:
        """Returns A z (n,3); `block` is the result of `prepare_filtered` for this state."""
        out = np.empty_like(z)
        _product(self._operator(block), z, out)
        return out

    def residual2(
        self, z: FloatArray, block: FloatArray, rhs: FloatArray, mode: IntArray, normal: FloatArray
    ) -> float:
        """Returns ‖Π (rhs − A z)‖² for (n,3) `z` and `rhs`."""
        size2: float = _residual2(self._operator(block), z, rhs, mode, normal)
        return size2

    def solve(
        self,
        preconditioner: Preconditioner,
        block: FloatArray,
        bound: Bound,
        rhs: FloatArray,
        z: FloatArray,
        stop: Stop,
        applied: FloatArray | None = None,
    ) -> tuple[int, float]:
        """Improves `z` (n,3) in place until ‖r‖ ≤ tolerance ‖Π against‖ in the factor's norm.

        It also stops, and the tolerance counts as met, once ‖r‖ has fallen to rounding level or to
        a hundredth of the tolerance relative to its initial value.

        `z` holds the initial guess. Its free part is improved. Its prescribed part (held and
        sticking nodes, the normal component of slipping ones) is kept and enters the right-hand
        side through A. `applied`, if given, receives A z (n,3), a by-product.

        Returns:
            Number of iterations, and the last relative residual.
        """
        factor, across = preconditioner.factor, preconditioner.across
        if across is None:
            across = np.zeros((0, 3)), np.zeros(0)
        return _filtered_cg(
            self._operator(block),
            (factor.blocks, factor.pattern.permutation),
            factor.masked,
            self._inverse_diagonal,
            bound.mode,
            bound.normal,
            rhs,
            rhs if stop.against is None else stop.against,
            z,
            stop.tolerance,
            stop.max_iterations,
            np.zeros(0) if bound.resistance is None else bound.resistance,
            across,
            np.empty((0, 3)) if applied is None else applied,
        )

    def solve_pair(
        self,
        factor: Factor,
        block: FloatArray,
        rhs: tuple[FloatArray, FloatArray],
        z: tuple[FloatArray, FloatArray],
        tolerance: float,
        max_iterations: int,
    ) -> tuple[int, int]:
        """Improves both `z` like `solve`, where only the nodes that `factor` leaves out are bound.

        The factor is read once for both. The tolerance is relative to the initial residuals.
        Relative to what is prescribed, unchanged motion would seem right to a percent at every
        step.

        Returns:
            Number of iterations for each.
        """
        return _filtered_cg_pair(
            self._operator(block),
            (factor.blocks, factor.pattern.permutation),
            factor.masked,
            *rhs,
            *z,
            tolerance,
            max_iterations,
        )


@nb.njit(cache=True, nogil=True)
def _product(operator, z, out):  # type: ignore[no-untyped-def]
    """Writes A z (n,3) into `out`."""
    rows = _rows(z)
    product = np.empty_like(rows)
    _apply(operator, rows, product)
    out[:] = product[:, :3]


@nb.njit(cache=True, nogil=True)
def _residual2(operator, z, rhs, mode, normal):  # type: ignore[no-untyped-def]
    rows, residual = _rows(z), _rows(rhs)
    product = np.empty_like(rows)
    _apply(operator, rows, product)
    add(residual, -1.0, product)
    project(residual, mode, normal)
    return dot(residual, residual)


@nb.njit(cache=True, nogil=True)
def _rows(z):  # type: ignore[no-untyped-def]
    """Returns (n,4): `z` (n,3) padded with zeros, so that each row fills a vector register."""
    rows = np.empty((z.shape[0], 4))
    for i in range(z.shape[0]):
        rows[i, 0] = z[i, 0]
        rows[i, 1] = z[i, 1]
        rows[i, 2] = z[i, 2]
        rows[i, 3] = 0.0
    return rows


@nb.njit(cache=True, nogil=True, forceinline=True)
def _apply(operator, z, out):  # type: ignore[no-untyped-def]
    """Writes A z into `out`, both in rows of four (n,4)."""
    indptr, indices, data, triangle, gradient, corners, share, weight, fibres, block, scale, of = (
        operator
    )
    row_product(indptr, indices, data, z, out)
    if scale != 0.0:
        if block.shape[1] == BUCKLED_ROWS:
            buckled_product(z, triangle, gradient, block, scale, out)
        else:
            filtered_product(z, triangle, gradient, block, scale, out)
        fibre_product(z, corners, share, weight, fibres, scale, out)
    node, row, resistance = of
    bond_product(z, node, row, resistance, out)


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
    """Projects the vectors in `z` (n,3 or more), in place, onto what the modes leave free."""
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
        elif m == 4:
            d = z[i, 0] * normal[i, 0] + z[i, 1] * normal[i, 1] + z[i, 2] * normal[i, 2]
            z[i, 0] = d * normal[i, 0]
            z[i, 1] = d * normal[i, 1]
            z[i, 2] = d * normal[i, 2]


@nb.njit(cache=True, nogil=True)
def _filtered_cg(  # type: ignore[no-untyped-def]
    operator,
    factor,
    masked,
    masked_scale,
    mode,
    normal,
    rhs,
    against,
    z,
    tolerance,
    max_iterations,
    resistance,
    across,
    applied,
):
    n = rhs.shape[0]
    work = np.empty((n, 4))
    direction = np.empty((n, 4))
    product = np.empty((n, 4))
    force = np.empty((n, 4))
    preconditioned = np.zeros((n, 4))
    solution = _rows(z)
    # Resistance c stiffens its nodes; the preconditioner D M⁻¹ D, D² = P_ii / (P_ii + c_i),
    # accounts for that.
    damped = np.empty(resistance.shape[0])
    for i in range(damped.shape[0]):
        damped[i] = 1.0 / np.sqrt(1.0 + resistance[i] * masked_scale[i])
    scaled = np.zeros((resistance.shape[0], 4))
    preconditioner = (factor, masked, masked_scale, mode, normal, work, damped, scaled)
    facing, light = across
    give = np.empty(light.shape[0])
    for i in range(give.shape[0]):
        r = resistance[i] if damped.shape[0] > 0 else 0.0
        give[i] = _ACROSS * light[i] / (1.0 + r * light[i])

    residual = _rows(against)
    project(residual, mode, normal)
    _precondition(preconditioner, residual, preconditioned)
    floor = max(dot(residual, preconditioned), 1e-300)

    _apply(operator, solution, force)
    residual[:] = force
    _resist(resistance, solution, residual)
    for i in range(n):
        for c in range(3):
            residual[i, c] = rhs[i, c] - residual[i, c]
    project(residual, mode, normal)
    _precondition(preconditioner, residual, preconditioned)
    left = dot(residual, preconditioned)
    rho = left + _go_across(facing, give, mode, normal, residual, preconditioned)
    direction[:] = preconditioned
    least = max(_OF_THE_START * tolerance, _ROUNDING)
    goal = max(tolerance * tolerance * floor, least * least * left)
    iterations = 0
    while iterations < max_iterations and left > goal:
        _apply(operator, direction, product)
        # The direction is free, so projecting the product would not change the curvature.
        curvature = dot(direction, product) + _resisted(resistance, direction)
        if curvature <= 0.0:
            break
        alpha = rho / curvature
        add(solution, alpha, direction)
        add(force, alpha, product)
        _resist(resistance, direction, product)
        project(product, mode, normal)
        add(residual, -alpha, product)
        _precondition(preconditioner, residual, preconditioned)
        left = dot(residual, preconditioned)
        new = left + _go_across(facing, give, mode, normal, residual, preconditioned)
        beta = new / rho
        rho = new
        turn(direction, beta, preconditioned)
        iterations += 1
    z[:] = solution[:, :3]
    if applied.shape[0] > 0:
        applied[:] = force[:, :3]
    relative = np.sqrt(max(left, 0.0) / floor)
    return iterations, min(relative, tolerance) if left <= goal else relative


@nb.njit(cache=True, nogil=True)
def _filtered_cg_pair(  # type: ignore[no-untyped-def]
    operator, factor, masked, rhs, other_rhs, z, other_z, tolerance, most
):
    n = rhs.shape[0]
    blocks, permutation = factor
    sides = (rhs, other_rhs)
    solutions = (_rows(z), _rows(other_z))
    residual = np.empty((2, n, 4))
    direction = np.empty((2, n, 4))
    ahead = np.zeros((2, n, 4))
    product = np.empty((n, 4))
    rho, goal = np.empty(2), np.empty(2)
    iterations = np.zeros(2, dtype=np.int64)
    for s in range(2):
        _apply(operator, solutions[s], product)
        residual[s] = _rows(sides[s])
        add(residual[s], -1.0, product)
        _release(residual[s], masked)
    solve_pair_into(blocks, permutation, residual[0], residual[1], ahead[0], ahead[1])
    for s in range(2):
        rho[s] = dot(residual[s], ahead[s])
        goal[s] = tolerance * tolerance * rho[s]
        direction[s] = ahead[s]
    while True:
        running = False
        for s in range(2):
            if iterations[s] >= most or rho[s] <= goal[s]:
                continue
            _apply(operator, direction[s], product)
            _release(product, masked)
            curvature = dot(direction[s], product)
            if curvature <= 0.0:
                rho[s] = 0.0
                continue
            alpha = rho[s] / curvature
            add(solutions[s], alpha, direction[s])
            add(residual[s], -alpha, product)
            iterations[s] += 1
            running = running or iterations[s] < most
        if not running:
            z[:] = solutions[0][:, :3]
            other_z[:] = solutions[1][:, :3]
            return iterations[0], iterations[1]
        solve_pair_into(blocks, permutation, residual[0], residual[1], ahead[0], ahead[1])
        for s in range(2):
            new = dot(residual[s], ahead[s])
            turn(direction[s], new / rho[s] if rho[s] > 0.0 else 0.0, ahead[s])
            rho[s] = new if rho[s] > goal[s] else rho[s]


@nb.njit(cache=True, nogil=True)
def _release(z, masked):  # type: ignore[no-untyped-def]
    """Sets rows of masked nodes of `z` (n,3 or more) to zero."""
    for i in range(z.shape[0]):
        if masked[i]:
            z[i, 0] = 0.0
            z[i, 1] = 0.0
            z[i, 2] = 0.0


@nb.njit(cache=True, nogil=True)
def _resist(resistance, z, out):  # type: ignore[no-untyped-def]
    """Adds c z to `out`; `resistance` c is (n,) or empty."""
    for i in range(resistance.shape[0]):
        if resistance[i] > 0.0:
            for c in range(3):
                out[i, c] += resistance[i] * z[i, c]


@nb.njit(cache=True, nogil=True)
def _resisted(resistance, z):  # type: ignore[no-untyped-def]
    """Returns zᵀ c z; `resistance` c is (n,) or empty."""
    total = 0.0
    for i in range(resistance.shape[0]):
        if resistance[i] > 0.0:
            total += resistance[i] * (z[i, 0] ** 2 + z[i, 1] ** 2 + z[i, 2] ** 2)
    return total


@nb.njit(cache=True, nogil=True)
def _go_across(facing, give, mode, normal, residual, out):  # type: ignore[no-untyped-def]
    """Adds Π f g fᵀ `residual` of each node to `out`; returns its product with `residual`.

    f (n,3) is the cloth's normal, g (n,) its compliance there; `residual` is in the range of Π.
    """
    total = 0.0
    for i in range(give.shape[0]):
        m = mode[i]
        if m == 1 or m == 3:
            continue
        f0, f1, f2 = facing[i, 0], facing[i, 1], facing[i, 2]
        along = f0 * residual[i, 0] + f1 * residual[i, 1] + f2 * residual[i, 2]
        if m == 2:
            d = f0 * normal[i, 0] + f1 * normal[i, 1] + f2 * normal[i, 2]
            f0 -= d * normal[i, 0]
            f1 -= d * normal[i, 1]
            f2 -= d * normal[i, 2]
        elif m == 4:
            d = f0 * normal[i, 0] + f1 * normal[i, 1] + f2 * normal[i, 2]
            f0, f1, f2 = d * normal[i, 0], d * normal[i, 1], d * normal[i, 2]
        step = give[i] * along
        out[i, 0] += step * f0
        out[i, 1] += step * f1
        out[i, 2] += step * f2
        total += step * along
    return total


@nb.njit(cache=True, nogil=True, forceinline=True)
def _precondition(preconditioner, residual, out):  # type: ignore[no-untyped-def]
    factor, masked, masked_scale, mode, normal, work, damped, scaled = preconditioner
    blocks, permutation = factor
    if damped.shape[0] > 0:
        for i in range(residual.shape[0]):
            for c in range(3):
                scaled[i, c] = damped[i] * residual[i, c]
        solve_rows(blocks, permutation, scaled, out, work)
        for i in range(residual.shape[0]):
            for c in range(3):
                out[i, c] *= damped[i]
    else:
        solve_rows(blocks, permutation, residual, out, work)
    for i in range(residual.shape[0]):
        if masked[i]:
            out[i, 0] = masked_scale[i] * residual[i, 0]
            out[i, 1] = masked_scale[i] * residual[i, 1]
            out[i, 2] = masked_scale[i] * residual[i, 2]
            if damped.shape[0] > 0:
                for c in range(3):
                    out[i, c] *= damped[i] ** 2
    project(out, mode, normal)
