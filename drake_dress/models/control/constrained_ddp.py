"""Constrained differential dynamic programming for the local problem (Alg. cddp).

Backward pass: the cost-to-go is a quadratic of the state. Active bounds are linear in the step's
state and input; what of them no input can change, the null space, is a condition on the state and
is handed to the step before (Eq. future-constraint). Forward pass: the feedback law gives a new
trajectory and the bounds' multipliers, which travel the other way: a condition that was handed to
an earlier step hands its multiplier back. Bounds with a negative multiplier are let go, bounds that
the new trajectory exceeds are taken in (Eq. sigma_j), and the step is shortened until cost and
excess together fall.

Three things are more than the print has, each for a reason. Rows carry what is missing to their
bound, as a tangent plane alone drifts off a ball. A ball's curvature, weighted by its multiplier,
is part of the cost: with it the passes converge quadratically and end on the bounds to rounding.
And rows that depend on each other are dropped, as seven bounds on six inputs may be.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numba as nb
import numpy as np

from drake_dress.models.cloth.elements import FloatArray
from drake_dress.models.control.interior_point import interior_point
from drake_dress.models.control.local_problem import LocalProblem, LocalSolution

# A row whose part in the inputs is less than this of itself once the others' are taken off is none.
_DEPENDENT = 1e-7
# Excess of a bound, m or m/s, below which it counts as held.
_TOLERANCE = 1e-9
# Change of states and inputs at which the passes end.
_SMALLEST_STEP = 1e-7
# Of multipliers, relative to the largest.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Settings:
    """When to give up.

    Attributes:
        warm_sweeps: backward and forward passes from an earlier solution's multipliers, before the
            interior point method is asked.
        max_sweeps: such passes after it.
        max_halvings: of a step that does not lower cost and excess.
        max_interior_steps: of the interior point method; from a guess a third of them.
        tolerance: at which that one ends, see `interior_point`.
    """

    warm_sweeps: int = 4
    max_sweeps: int = 20
    max_halvings: int = 12
    max_interior_steps: int = 120
    tolerance: float = 1e-8


def solve_constrained_ddp(
    problem: LocalProblem,
    guess: FloatArray | None = None,
    state_multiplier: FloatArray | None = None,
    input_multiplier: FloatArray | None = None,
    settings: Settings = Settings(),
) -> LocalSolution:
    """Returns the optimum of a local problem.

    Args:
        problem: to solve; bounds on states may depend on each other.
        guess: (N,m) inputs to start from; zero if None.
        state_multiplier: (N+1,K) of an earlier solution; positive ones start as active.
        input_multiplier: (N,L) likewise.
        settings: when to give up.
    """
    p = problem
    steps, m = p.input_weight.shape
    v = np.zeros((steps, m)) if guess is None else np.array(guess, dtype=np.float64)
    lx: FloatArray = np.zeros(p.state_bounds.radius.shape)
    lv: FloatArray = np.zeros(p.input_bounds.radius.shape)
    if state_multiplier is not None:
        lx[:] = state_multiplier
    if input_multiplier is not None:
        lv[:] = input_multiplier
    # x_j − x_0 = B u_j with u_j the sum of inputs: m coordinates in place of n
    b = p.input_matrix
    w, r = 2.0 * p.state_weight, 2.0 * p.input_weight
    costs = _contiguous(
        np.einsum("tn,na,nb->tab", w, b, b),
        (w * (p.start - p.state_target)) @ b,
        r,
        -r * p.input_target,
    )
    on_states = _contiguous(
        p.state_bounds.matrix @ b,
        p.state_bounds.offset + p.state_bounds.matrix @ p.start,
        p.state_bounds.radius,
    )
    on_inputs = _contiguous(p.input_bounds.matrix, p.input_bounds.offset, p.input_bounds.radius)
    u, gain, integrator = np.empty((steps + 1, m)), np.zeros((steps, m, m)), np.eye(m)
    solve: Any = _solve
    start_inside: Any = interior_point
    sweeps, interior, converged = 0, 0, False
    starts = [(np.zeros_like(v), settings.max_interior_steps)]
    if guess is not None:
        starts.insert(0, (v.copy(), settings.max_interior_steps // 3))
    if state_multiplier is not None:
        sweeps, converged = solve(
            integrator, *costs, *on_states, *on_inputs, v, u, lx, lv, gain,
            settings.warm_sweeps, settings.max_halvings,
        )  # fmt: skip
        converged = converged and _are_within(p.price, lx, lv)
    if not converged:
        together = [
            np.concatenate([a[1:], c], axis=1) for a, c in zip(on_states, on_inputs, strict=True)
        ]
        n_x, n_v = len(lx[0]), len(lv[0])
        multiplier, excess = np.empty((steps, n_x + n_v)), np.empty((steps, n_x + n_v))
        for start, most in starts:
            v[:] = start
            iterations, near = start_inside(
                *costs, *together, n_x, v, u, multiplier, excess, p.price, most, settings.tolerance
            )  # fmt: skip
            interior += iterations
            if near:
                break
        lx[1:], lv[:] = multiplier[:, :n_x], multiplier[:, n_x:]
        if near:
            # bounds that nothing keeps are widened by as little as can be
            _widen(on_states[2][1:], excess[:, :n_x])
            _widen(on_inputs[2], excess[:, n_x:])
            inside = v.copy(), lx.copy(), lv.copy()
            more, converged = solve(
                integrator, *costs, *on_states, *on_inputs, v, u, lx, lv, gain,
                settings.max_sweeps, settings.max_halvings,
            )  # fmt: skip
            sweeps += more
            if not converged:
                v, lx, lv = inside
            elif not _are_within(p.price, lx, lv):
                _, lx, lv = inside
            converged = True
        elif not np.isfinite(v).all():
            v[:], lx[:], lv[:] = 0.0, 0.0, 0.0
    return LocalSolution(
        v, p.states(v), lx, lv, p.cost(v), p.violation(v), sweeps, interior, bool(converged)
    )


def _are_within(price: float, *multipliers: FloatArray) -> bool:
    """Returns whether no multiplier is beyond the price of an excess.

    Of bounds that only just leave room, sweeps may end on multipliers beyond all measure.
    """
    return all(m.max(initial=0.0) <= price for m in multipliers)


def _widen(radius: FloatArray, excess: FloatArray) -> None:
    """Widens bounds (T,K) in place to √(φ² + 2 φ t), those with no excess t not at all."""
    wide = excess > 0.0
    radius[wide] = np.sqrt(radius[wide] * (radius[wide] + 2.0 * excess[wide]))


def _contiguous(*arrays: FloatArray) -> list[FloatArray]:
    return [np.array(a, dtype=np.float64, order="C") for a in arrays]


def feedback_gains(problem: LocalProblem, solution: LocalSolution) -> FloatArray:
    """Returns (N,m,n) ∂v/∂x about a solution, along the bounds that are active there.

    It is a backward pass with all n states, not only those m that the inputs reach: what is
    measured between two solves need not lie among them.
    """
    p = problem
    steps, m = p.input_weight.shape
    n = len(p.start)
    n_x, n_v = p.state_bounds.radius.shape[1], p.input_bounds.radius.shape[1]
    x_normal, x_size = np.zeros((steps + 1, n_x, 3)), np.zeros((steps + 1, n_x))
    v_normal, v_size = np.zeros((steps, n_v, 3)), np.zeros((steps, n_v))
    x_excess, v_excess = np.zeros((steps + 1, n_x)), np.zeros((steps, n_v))
    for bounds, z, normal, size, excess in (
        (p.state_bounds, solution.x, x_normal, x_size, x_excess),
        (p.input_bounds, solution.v, v_normal, v_size, v_excess),
    ):
        _bounds(bounds.matrix, bounds.offset, bounds.radius, z, 0, normal, size, excess)
    hessian = np.zeros((steps + 1, n, n))
    hessian[:, range(n), range(n)] = 2.0 * p.state_weight
    gain, feedforward = np.zeros((steps, m, n)), np.zeros((steps, m))
    work = _workspace(steps, n, m, n_x + n_v + n)
    backward: Any = _backward
    backward(
        p.input_matrix,
        hessian,
        2.0 * p.input_weight,
        2.0 * p.state_weight * (solution.x - p.state_target),
        2.0 * p.input_weight * (solution.v - p.input_target),
        p.state_bounds.matrix,
        x_normal,
        x_size,
        x_excess,
        solution.state_multiplier > 0.0,
        solution.state_multiplier,
        p.input_bounds.matrix,
        v_normal,
        v_size,
        v_excess,
        solution.input_multiplier > 0.0,
        solution.input_multiplier,
        *work,
        gain,
        feedforward,
    )
    return gain


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _workspace(steps, n, m, rows):  # type: ignore[no-untyped-def]
    """Returns what a backward pass leaves for the forward pass, in the order of its arguments."""
    return (
        np.empty((steps, m, m)),
        np.empty((steps, m, n)),
        np.empty((steps, m)),
        np.empty((steps, m, m + n + 1)),
        np.zeros(steps, np.int64),
        np.zeros((steps, rows, m)),
        np.zeros((steps, rows), np.int64),
        np.zeros(steps, np.int64),
        np.zeros((steps, rows, 2), np.int64),
        np.zeros((steps, rows)),
    )


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _bounds(matrix, offset, radius, z, first, normal, size, excess):  # type: ignore[no-untyped-def]
    """Fills unit vectors (T,K,3), norms and excesses (T,K) of norm bounds; returns their sum."""
    total = 0.0
    for t in range(first, matrix.shape[0]):
        for k in range(matrix.shape[1]):
            if radius[t, k] == np.inf:
                excess[t, k] = -np.inf
                continue
            length2 = 0.0
            for a in range(3):
                y = offset[t, k, a]
                for b in range(z.shape[1]):
                    y += matrix[t, k, a, b] * z[t, b]
                normal[t, k, a] = y
                length2 += y * y
            length = np.sqrt(length2)
            size[t, k] = length
            if length > 0.0:
                for a in range(3):
                    normal[t, k, a] /= length
            over = length - radius[t, k]
            excess[t, k] = over
            if over > 0.0:
                total += over
    return total


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _cost(x, v, w, w_x, r, r_v, x_slope, v_slope):  # type: ignore[no-untyped-def]
    """Fills slopes w x + w_x and r v + r_v; returns Σ ½ xᵀw x + w_xᵀx + ½ vᵀr v + r_vᵀv."""
    total = 0.0
    for t in range(1, x.shape[0]):
        for a in range(x.shape[1]):
            s = 0.0
            for e in range(x.shape[1]):
                s += w[t, a, e] * x[t, e]
            x_slope[t, a] = s + w_x[t, a]
            total += x[t, a] * (0.5 * s + w_x[t, a])
    for t in range(v.shape[0]):
        for a in range(v.shape[1]):
            s = r[t, a] * v[t, a]
            v_slope[t, a] = s + r_v[t, a]
            total += v[t, a] * (0.5 * s + r_v[t, a])
    return total


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _roll(b, v, x):  # type: ignore[no-untyped-def]
    n, m = b.shape
    x[0] = 0.0
    for t in range(v.shape[0]):
        for a in range(n):
            s = x[t, a]
            for c in range(m):
                s += b[a, c] * v[t, c]
            x[t + 1, a] = s


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _add_curvature(matrix, normal, factor, out):  # type: ignore[no-untyped-def]
    """Adds factor · Cᵀ(I − nnᵀ)C to `out` (n,n), for a C (3,n) with n (3,)."""
    n = matrix.shape[1]
    row = np.empty(n)
    for b in range(n):
        row[b] = matrix[0, b] * normal[0] + matrix[1, b] * normal[1] + matrix[2, b] * normal[2]
    for a in range(n):
        m0, m1, m2 = matrix[0, a], matrix[1, a], matrix[2, a]
        if m0 == 0.0 and m1 == 0.0 and m2 == 0.0:
            continue
        for b in range(n):
            out[a, b] += factor * (
                m0 * matrix[0, b] + m1 * matrix[1, b] + m2 * matrix[2, b] - row[a] * row[b]
            )


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _orthonormal_rows(rows, count, m, basis, residual, owner, coefficient):  # type: ignore[no-untyped-def]
    """Splits rows [G_v | G_x | s] into an orthonormal basis in v and what v cannot change.

    rows = coefficient · basis + residual, with the basis [Y | Z | t]; where a row has given a
    basis vector `owner` is that vector's index and its residual is zero, elsewhere it is −1 and the
    v part of its residual is zero. Pivots are the largest left. Returns the size of the basis.
    """
    width = rows.shape[1]
    rank = 0
    scale = np.empty(count)
    for i in range(count):
        owner[i] = -1
        s = 0.0
        for c in range(m):
            s += rows[i, c] ** 2
        scale[i] = s
        for c in range(width):
            residual[i, c] = rows[i, c]
        for k in range(m):
            coefficient[i, k] = 0.0
    while rank < m:
        best, largest = -1, _DEPENDENT**2
        for i in range(count):
            if owner[i] >= 0 or scale[i] == 0.0:
                continue
            s = 0.0
            for c in range(m):
                s += residual[i, c] ** 2
            if s > largest * scale[i]:
                best, largest = i, s / scale[i]
        if best < 0:
            break
        length = 0.0
        for c in range(m):
            length += residual[best, c] ** 2
        length = np.sqrt(length)
        for c in range(width):
            basis[rank, c] = residual[best, c] / length
        for i in range(count):
            if owner[i] >= 0:
                continue
            along = 0.0
            for c in range(m):
                along += residual[i, c] * basis[rank, c]
            coefficient[i, rank] = along
            for c in range(width):
                residual[i, c] -= along * basis[rank, c]
        owner[best] = rank
        rank += 1
    return rank


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _complete(basis, rank, m, free):  # type: ignore[no-untyped-def]
    """Fills `free` (m−rank,m) with unit vectors across the basis and each other."""
    found = 0
    tried = np.zeros(m, dtype=np.bool_)
    work = np.empty(m)
    best_row = np.empty(m)
    while rank + found < m:
        best, largest = -1, -1.0
        for c in range(m):
            if tried[c]:
                continue
            for a in range(m):
                work[a] = 0.0
            work[c] = 1.0
            for _ in range(2):
                for k in range(rank):
                    s = 0.0
                    for a in range(m):
                        s += work[a] * basis[k, a]
                    for a in range(m):
                        work[a] -= s * basis[k, a]
                for k in range(found):
                    s = 0.0
                    for a in range(m):
                        s += work[a] * free[k, a]
                    for a in range(m):
                        work[a] -= s * free[k, a]
            s = 0.0
            for a in range(m):
                s += work[a] ** 2
            if s > largest:
                best, largest = c, s
                for a in range(m):
                    best_row[a] = work[a]
        tried[best] = True
        length = np.sqrt(largest)
        for a in range(m):
            free[found, a] = best_row[a] / length
        found += 1
    return found


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _solve_spd(h, size, rhs, columns):  # type: ignore[no-untyped-def]
    """Solves h z = rhs in place by Cholesky; returns whether h is positive definite."""
    for i in range(size):
        for j in range(i + 1):
            s = h[i, j]
            for k in range(j):
                s -= h[i, k] * h[j, k]
            if i == j:
                if s <= 0.0:
                    return False
                h[i, i] = np.sqrt(s)
            else:
                h[i, j] = s / h[j, j]
    for c in range(columns):
        for i in range(size):
            s = rhs[i, c]
            for k in range(i):
                s -= h[i, k] * rhs[k, c]
            rhs[i, c] = s / h[i, i]
        for i in range(size - 1, -1, -1):
            s = rhs[i, c]
            for k in range(i + 1, size):
                s -= h[k, i] * rhs[k, c]
            rhs[i, c] = s / h[i, i]
    return True


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _backward(  # type: ignore[no-untyped-def]
    b_matrix,
    w,
    r,
    x_slope,
    v_slope,
    x_matrix,
    x_normal,
    x_size,
    x_excess,
    x_active,
    x_multiplier,
    v_matrix,
    v_normal,
    v_size,
    v_excess,
    v_active,
    v_multiplier,
    q_vv,
    q_vx,
    q_v,
    basis,
    rank,
    coefficient,
    owner,
    count,
    source,
    carried_scale,
    gain,
    feedforward,
):
    """Fills the feedback law δv = gain δx + feedforward of each step, and what made it."""
    n, m = b_matrix.shape
    steps = v_slope.shape[0]
    most_rows = owner.shape[1]
    p_xx, p_x = np.zeros((n, n)), np.zeros(n)
    p_b = np.empty((n, m))
    rows = np.empty((most_rows, m + n + 1))
    residual = np.empty((most_rows, m + n + 1))
    free = np.empty((m, m))
    reduced, right = np.empty((m, m)), np.empty((m, n + 1))
    both = np.empty((m, n + 1))
    law = np.empty((m, n + 1))
    value = np.empty((n, n))
    for i in range(steps - 1, -1, -1):
        # cost-to-go at x_{i+1}
        for a in range(n):
            p_x[a] += x_slope[i + 1, a]
            for e in range(n):
                p_xx[a, e] += w[i + 1, a, e]
        for k in range(x_active.shape[1]):
            if x_active[i + 1, k] and x_multiplier[i + 1, k] > 0.0 and x_size[i + 1, k] > 0.0:
                _add_curvature(
                    x_matrix[i + 1, k],
                    x_normal[i + 1, k],
                    x_multiplier[i + 1, k] / x_size[i + 1, k],
                    p_xx,
                )
        # action value (Eq. VQ-define); the state is an integrator
        for a in range(n):
            for c in range(m):
                s = 0.0
                for e in range(n):
                    s += p_xx[a, e] * b_matrix[e, c]
                p_b[a, c] = s
        for c in range(m):
            s = v_slope[i, c]
            for a in range(n):
                q_vx[i, c, a] = p_b[a, c]
                s += b_matrix[a, c] * p_x[a]
            q_v[i, c] = s
            for e in range(c + 1):
                s = 0.0
                for a in range(n):
                    s += b_matrix[a, c] * p_b[a, e]
                q_vv[i, c, e] = s
                q_vv[i, e, c] = s
            q_vv[i, c, c] += r[i, c]
        for k in range(v_active.shape[1]):
            if v_active[i, k] and v_multiplier[i, k] > 0.0 and v_size[i, k] > 0.0:
                _add_curvature(
                    v_matrix[i, k], v_normal[i, k], v_multiplier[i, k] / v_size[i, k], q_vv[i]
                )
        # rows of active bounds [g_v | g_x | g] and what the step after hands over
        number = 0
        for k in range(v_active.shape[1]):
            if v_active[i, k] and number < most_rows:
                for c in range(m):
                    s = 0.0
                    for a in range(3):
                        s += v_matrix[i, k, a, c] * v_normal[i, k, a]
                    rows[number, c] = s
                for a in range(n):
                    rows[number, m + a] = 0.0
                rows[number, m + n] = v_excess[i, k]
                source[i, number, 0], source[i, number, 1] = 0, k
                number += 1
        for k in range(x_active.shape[1]):
            if x_active[i + 1, k] and number < most_rows:
                for e in range(n):
                    s = 0.0
                    for a in range(3):
                        s += x_matrix[i + 1, k, a, e] * x_normal[i + 1, k, a]
                    rows[number, m + e] = s
                rows[number, m + n] = x_excess[i + 1, k]
                source[i, number, 0], source[i, number, 1] = 1, k
                number += 1
        if i + 1 < steps:
            for k in range(count[i + 1]):
                if owner[i + 1, k] >= 0 or carried_scale[i + 1, k] == 0.0 or number >= most_rows:
                    continue
                # `residual` still is that of the step after
                for a in range(n + 1):
                    both_a = residual[k, m + a] / carried_scale[i + 1, k]
                    rows[number, m + a] = both_a
                source[i, number, 0], source[i, number, 1] = 2, k
                number += 1
        for k in range(number):
            if source[i, k, 0] == 0:
                continue
            for c in range(m):
                s = 0.0
                for a in range(n):
                    s += rows[k, m + a] * b_matrix[a, c]
                rows[k, c] = s
        count[i] = number
        rank[i] = _orthonormal_rows(rows, number, m, basis[i], residual, owner[i], coefficient[i])
        for k in range(number):
            carried_scale[i, k] = 0.0
            if owner[i, k] < 0:
                s, whole = 0.0, 0.0
                for a in range(n):
                    s += residual[k, m + a] ** 2
                    whole += rows[k, m + a] ** 2
                if s > 1e-16 * max(whole, 1e-8):
                    carried_scale[i, k] = np.sqrt(s)
        # the law: what the rows ask for, and the best across them
        size = rank[i]
        for c in range(m):
            for a in range(n + 1):
                s = 0.0
                for k in range(size):
                    s -= basis[i, k, c] * basis[i, k, m + a]
                law[c, a] = s
        across = _complete(basis[i], size, m, free)
        if across > 0:
            for c in range(m):
                for a in range(n + 1):
                    s = q_vx[i, c, a] if a < n else q_v[i, c]
                    for e in range(m):
                        s += q_vv[i, c, e] * law[e, a]
                    both[c, a] = s
            for k in range(across):
                for a in range(n + 1):
                    s = 0.0
                    for c in range(m):
                        s -= free[k, c] * both[c, a]
                    right[k, a] = s
                for e in range(k + 1):
                    s = 0.0
                    for c in range(m):
                        t = 0.0
                        for d in range(m):
                            t += q_vv[i, c, d] * free[e, d]
                        s += free[k, c] * t
                    reduced[k, e] = s
            _solve_spd(reduced, across, right, n + 1)
            for c in range(m):
                for a in range(n + 1):
                    s = law[c, a]
                    for k in range(across):
                        s += free[k, c] * right[k, a]
                    law[c, a] = s
        for c in range(m):
            for a in range(n):
                gain[i, c, a] = law[c, a]
            feedforward[i, c] = law[c, n]
        # cost-to-go at x_i
        for c in range(m):
            for a in range(n + 1):
                s = q_vx[i, c, a] if a < n else q_v[i, c]
                for e in range(m):
                    s += q_vv[i, c, e] * law[e, a]
                both[c, a] = s
        for a in range(n):
            for e in range(a + 1):
                s = p_xx[a, e]
                for c in range(m):
                    s += law[c, a] * both[c, e] + q_vx[i, c, a] * law[c, e]
                value[a, e] = s
                value[e, a] = s
            s = p_x[a]
            for c in range(m):
                s += law[c, a] * both[c, n] + q_vx[i, c, a] * law[c, n]
            p_x[a] = s
        for a in range(n):
            for e in range(n):
                p_xx[a, e] = value[a, e]


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _forward(  # type: ignore[no-untyped-def]
    b_matrix,
    q_vv,
    q_vx,
    q_v,
    basis,
    rank,
    coefficient,
    owner,
    count,
    source,
    carried_scale,
    gain,
    feedforward,
    dx,
    dv,
    x_multiplier,
    v_multiplier,
):
    """Fills the new trajectory's distance to the old one, and the multipliers of active bounds."""
    n, m = b_matrix.shape
    steps = dv.shape[0]
    most_rows = owner.shape[1]
    multiplier, handed = np.zeros(most_rows), np.zeros(most_rows)
    slope = np.empty(m)
    x_multiplier[:] = 0.0
    v_multiplier[:] = 0.0
    dx[0] = 0.0
    for i in range(steps):
        for c in range(m):
            s = feedforward[i, c]
            for a in range(n):
                s += gain[i, c, a] * dx[i, a]
            dv[i, c] = s
        for a in range(n):
            s = dx[i, a]
            for c in range(m):
                s += b_matrix[a, c] * dv[i, c]
            dx[i + 1, a] = s
        for c in range(m):
            s = q_v[i, c]
            for a in range(n):
                s += q_vx[i, c, a] * dx[i, a]
            for e in range(m):
                s += q_vv[i, c, e] * dv[i, e]
            slope[c] = s
        for k in range(count[i]):
            multiplier[k] = handed[k] if owner[i, k] < 0 else 0.0
        for rank_k in range(rank[i] - 1, -1, -1):
            s = 0.0
            for c in range(m):
                s -= basis[i, rank_k, c] * slope[c]
            pivot = -1
            for k in range(count[i]):
                if owner[i, k] == rank_k:
                    pivot = k
                elif owner[i, k] < 0 or owner[i, k] > rank_k:
                    s -= coefficient[i, k, rank_k] * multiplier[k]
            multiplier[pivot] = s / coefficient[i, pivot, rank_k]
        handed[:] = 0.0
        for k in range(count[i]):
            kind, which = source[i, k, 0], source[i, k, 1]
            if kind == 0:
                v_multiplier[i, which] = multiplier[k]
            elif kind == 1:
                x_multiplier[i + 1, which] = multiplier[k]
            else:
                handed[which] = multiplier[k] / carried_scale[i + 1, which]


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _judge(matrix, normal, excess, active, dz, found, linear, first):  # type: ignore[no-untyped-def]
    """Fills what the linear bounds say of the step (T,K); returns the extremes.

    Returns:
        The largest multiplier, the least one, and the largest excess of a bound that is not active.
    """
    largest, least, beyond = 0.0, 0.0, 0.0
    for t in range(first, excess.shape[0]):
        for k in range(excess.shape[1]):
            s = excess[t, k]
            linear[t, k] = s
            if s == -np.inf:
                continue
            if active[t, k]:
                largest, least = max(largest, found[t, k]), min(least, found[t, k])
                continue
            for e in range(dz.shape[1]):
                along = 0.0
                for a in range(3):
                    along += normal[t, k, a] * matrix[t, k, a, e]
                s += along * dz[t, e]
            linear[t, k] = s
            beyond = max(beyond, s)
    return largest, least, beyond


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _switch(active, found, excess, first):  # type: ignore[no-untyped-def]
    """Lets bounds go whose multiplier is not positive, and takes in those that are exceeded."""
    for t in range(first, active.shape[0]):
        for k in range(active.shape[1]):
            if active[t, k]:
                active[t, k] = found[t, k] > 0.0
            else:
                active[t, k] = excess[t, k] > _TOLERANCE


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _solve(  # type: ignore[no-untyped-def]
    b_matrix,
    w,
    w_x,
    r,
    r_v,
    x_matrix,
    x_offset,
    x_radius,
    v_matrix,
    v_offset,
    v_radius,
    v,
    x,
    x_multiplier,
    v_multiplier,
    gain,
    max_sweeps,
    max_halvings,
):
    """Sweeps from inputs `v` and multipliers until they are optimal; returns sweeps and whether."""
    n, m = b_matrix.shape
    steps = v.shape[0]
    n_x, n_v = x_radius.shape[1], v_radius.shape[1]
    work = _workspace(steps, n, m, n_x + n_v + n)
    (q_vv, q_vx, q_v, basis, rank, coefficient, owner, count, source, carried_scale) = work
    feedforward = np.empty((steps, m))
    dx, dv = np.zeros((steps + 1, n)), np.zeros((steps, m))
    x_new, v_new = np.empty_like(x), np.empty_like(v)
    x_slope, v_slope = np.zeros((steps + 1, n)), np.zeros((steps, m))
    x_scratch, v_scratch = np.empty((steps + 1, n)), np.empty((steps, m))
    x_normal, x_size = np.zeros((steps + 1, n_x, 3)), np.zeros((steps + 1, n_x))
    v_normal, v_size = np.zeros((steps, n_v, 3)), np.zeros((steps, n_v))
    x_way, x_length, x_over = x_normal.copy(), x_size.copy(), x_size.copy()
    v_way, v_length, v_over = v_normal.copy(), v_size.copy(), v_size.copy()
    x_excess, v_excess = np.full((steps + 1, n_x), -np.inf), np.full((steps, n_v), -np.inf)
    x_linear, v_linear = np.empty((steps + 1, n_x)), np.empty((steps, n_v))
    x_found, v_found = np.zeros((steps + 1, n_x)), np.zeros((steps, n_v))
    x_active = np.zeros((steps + 1, n_x), np.bool_)
    v_active = np.zeros((steps, n_v), np.bool_)

    _roll(b_matrix, v, x)
    excess = _bounds(x_matrix, x_offset, x_radius, x, 1, x_normal, x_size, x_excess)
    excess += _bounds(v_matrix, v_offset, v_radius, v, 0, v_normal, v_size, v_excess)
    cost = _cost(x, v, w, w_x, r, r_v, x_slope, v_slope)
    for t in range(steps):
        for k in range(n_x):
            x_active[t + 1, k] = x_multiplier[t + 1, k] > 0.0 or x_excess[t + 1, k] > -_TOLERANCE
        for k in range(n_v):
            v_active[t, k] = v_multiplier[t, k] > 0.0 or v_excess[t, k] > -_TOLERANCE
    price = 0.0
    for sweep in range(1, max_sweeps + 1):
        _backward(
            b_matrix, w, r, x_slope, v_slope,
            x_matrix, x_normal, x_size, x_excess, x_active, x_multiplier,
            v_matrix, v_normal, v_size, v_excess, v_active, v_multiplier,
            q_vv, q_vx, q_v, basis, rank, coefficient, owner, count, source, carried_scale,
            gain, feedforward,
        )  # fmt: skip
        _forward(
            b_matrix, q_vv, q_vx, q_v, basis, rank, coefficient, owner, count, source,
            carried_scale, gain, feedforward, dx, dv, x_found, v_found,
        )  # fmt: skip
        of_x = _judge(x_matrix, x_normal, x_excess, x_active, dx, x_found, x_linear, 1)
        of_v = _judge(v_matrix, v_normal, v_excess, v_active, dv, v_found, v_linear, 0)
        largest, least, beyond = max(of_x[0], of_v[0]), min(of_x[1], of_v[1]), max(of_x[2], of_v[2])
        # the active set is that of the quadratic programme: then the step leads down
        consistent = least > -_ROUNDING * max(largest, 1e-6) and beyond < _TOLERANCE
        price = max(price, 1.5 * largest)
        size, slope = 0.0, -price * excess
        for t in range(steps):
            for c in range(m):
                size = max(size, abs(dv[t, c]))
                slope += v_slope[t, c] * dv[t, c]
            for a in range(n):
                size = max(size, abs(dx[t + 1, a]))
                slope += x_slope[t + 1, a] * dx[t + 1, a]
        merit = cost + price * excess
        factor, accepted = 1.0, False
        for _ in range(max_halvings if consistent else 1):
            for t in range(steps):
                for c in range(m):
                    v_new[t, c] = v[t, c] + factor * dv[t, c]
            _roll(b_matrix, v_new, x_new)
            new_excess = _bounds(x_matrix, x_offset, x_radius, x_new, 1, x_way, x_length, x_over)
            new_excess += _bounds(v_matrix, v_offset, v_radius, v_new, 0, v_way, v_length, v_over)
            new_cost = _cost(x_new, v_new, w, w_x, r, r_v, x_scratch, v_scratch)
            allowed = 1e-4 * factor * min(slope, 0.0) + 1e-12 * (1.0 + abs(merit))
            if new_cost + price * new_excess <= merit + allowed:
                accepted = True
                break
            factor *= 0.5
        if accepted:
            v[:] = v_new
            x[:] = x_new
            excess = _bounds(x_matrix, x_offset, x_radius, x, 1, x_normal, x_size, x_excess)
            excess += _bounds(v_matrix, v_offset, v_radius, v, 0, v_normal, v_size, v_excess)
            cost = _cost(x, v, w, w_x, r, r_v, x_slope, v_slope)
            for t in range(steps):
                for k in range(n_x):
                    x_multiplier[t + 1, k] = max(0.0, x_found[t + 1, k])
                for k in range(n_v):
                    v_multiplier[t, k] = max(0.0, v_found[t, k])
            _switch(x_active, x_found, x_excess, 1)
            _switch(v_active, v_found, v_excess, 0)
            if consistent and factor == 1.0 and size < _SMALLEST_STEP:
                return sweep, True
        elif consistent:
            return sweep, False
        else:
            # the same trajectory again, with other bounds
            _switch(x_active, x_found, x_linear, 1)
            _switch(v_active, v_found, v_linear, 0)
    return max_sweeps, False
