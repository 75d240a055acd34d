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
from typing import Any, NamedTuple

import numba as nb
import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.control.interior_point import interior_point
from drake_dress.models.control.local_problem import LocalProblem, LocalSolution, NormBounds
from drake_dress.models.control.small_matrices import (
    add_curvature,
    complete_basis,
    solve_positive_definite,
    split_rows,
)

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


class _Cost(NamedTuple):
    """Σ ½ xᵀw x + w_xᵀx + ½ vᵀr v + r_vᵀv over a trajectory: (N+1,n,n), (N+1,n), (N,m), (N,m)."""

    w: FloatArray
    w_x: FloatArray
    r: FloatArray
    r_v: FloatArray


class _Bounds(NamedTuple):
    """Norm bounds ‖C z + d‖ ≤ φ on states or inputs, and what a trajectory makes of them.

    Attributes:
        matrix, offset, radius: C (T,K,3,d), d (T,K,3), φ (T,K).
        first: time of the first bound that counts: the start is what it is.
        normal, size, excess: unit vector and length of C z + d, (T,K,3) and (T,K); ‖C z + d‖ − φ.
        active, multiplier: (T,K).
    """

    matrix: FloatArray
    offset: FloatArray
    radius: FloatArray
    first: int
    normal: FloatArray
    size: FloatArray
    excess: FloatArray
    active: BoolArray
    multiplier: FloatArray


class _Law(NamedTuple):
    """What the backward pass leaves for the forward pass, for each step.

    Attributes:
        gain, feedforward: δv = gain δx + feedforward, (N,m,n) and (N,m).
        q_vv, q_vx, q_v: derivatives of the action value, (N,m,m), (N,m,n), (N,m).
        number: (N,) rows of active bounds, those that the step after handed over among them.
        source: (N,R,2) of a row: 0, 1, 2 for a bound on inputs, on states, a row of the step
            after; and which.
        basis, rank, coefficient, owner: of the rows, see `split_rows`.
        carried: (N,R) size of what is handed to the step before; 0 where nothing is.
    """

    gain: FloatArray
    feedforward: FloatArray
    q_vv: FloatArray
    q_vx: FloatArray
    q_v: FloatArray
    number: IntArray
    source: IntArray
    basis: FloatArray
    rank: IntArray
    coefficient: FloatArray
    owner: IntArray
    carried: FloatArray


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
    passes = _prepared(p, guess, state_multiplier, input_multiplier)
    v, on_x, on_v = passes.v, passes.on_x, passes.on_v
    sweeps, interior, converged = 0, 0, False
    if state_multiplier is not None:
        sweeps, converged = passes.sweep(settings.warm_sweeps, settings.max_halvings)
        converged = converged and passes.are_within_price
    if not converged:
        interior, near = _start_inside(passes, guess, settings)
        if near:
            more, converged = _polish(passes, settings)
            sweeps += more
        elif not np.isfinite(v).all():
            v[:], on_x.multiplier[:], on_v.multiplier[:] = 0.0, 0.0, 0.0
    return LocalSolution(
        v,
        p.states(v),
        on_x.multiplier,
        on_v.multiplier,
        p.cost(v),
        p.violation(v),
        sweeps,
        interior,
        bool(converged),
    )


@dataclass(frozen=True)
class _Passes:
    """A problem in the coordinates of the passes, and the solution so far; arrays change in place.

    Attributes:
        price: of the excess of a bound.
        cost: of u and v.
        on_x, on_v: bounds on u and v, with multipliers.
        v: (N,m) inputs.
        u: (N+1,m) their sums, filled by the passes.
    """

    price: float
    cost: _Cost
    on_x: _Bounds
    on_v: _Bounds
    v: FloatArray
    u: FloatArray

    def sweep(self, most: int, max_halvings: int) -> tuple[int, bool]:
        """Makes passes; returns how many, and whether they ended at an optimum."""
        sweep: Any = _sweep
        made, ended = sweep(self.cost, self.on_x, self.on_v, self.v, self.u, most, max_halvings)
        return made, ended

    @property
    def are_within_price(self) -> bool:
        """Whether no multiplier is beyond the price of an excess.

        Of bounds that only just leave room, sweeps may end on multipliers beyond all measure.
        """
        return all(b.multiplier.max(initial=0.0) <= self.price for b in (self.on_x, self.on_v))


def _prepared(
    p: LocalProblem,
    guess: FloatArray | None,
    state_multiplier: FloatArray | None,
    input_multiplier: FloatArray | None,
) -> _Passes:
    """Returns a problem for the passes, with what an earlier solution suggests."""
    steps, m = p.input_weight.shape
    v = np.zeros((steps, m)) if guess is None else np.array(guess, dtype=np.float64)
    # x_j − x_0 = B u_j with u_j the sum of inputs: m coordinates in place of n
    b = p.input_matrix
    w, r = 2.0 * p.state_weight, 2.0 * p.input_weight
    hessian, slope = np.einsum("tn,na,nb->tab", w, b, b), (w * (p.start - p.state_target)) @ b
    cost = _Cost(*map(np.ascontiguousarray, (hessian, slope, r, -r * p.input_target)))
    of_x, of_v = p.state_bounds, p.input_bounds
    on_x = _about(of_x.matrix @ b, of_x.offset + of_x.matrix @ p.start, of_x.radius, 1)
    on_v = _about(of_v.matrix, of_v.offset, of_v.radius, 0)
    if state_multiplier is not None:
        # those of the start are passed over
        on_x.multiplier[1:] = state_multiplier[1:]
    if input_multiplier is not None:
        on_v.multiplier[:] = input_multiplier
    return _Passes(p.price, cost, on_x, on_v, v, np.empty((steps + 1, m)))


def _start_inside(
    passes: _Passes, guess: FloatArray | None, settings: Settings
) -> tuple[int, bool]:
    """Fills inputs and multipliers by the interior point method, and widens what nothing keeps.

    Returns:
        Its iterations, and whether they sufficed.
    """
    method: Any = interior_point
    on_x, on_v, v = passes.on_x, passes.on_v, passes.v
    together = [np.concatenate([x[1:], y], axis=1) for x, y in zip(on_x[:3], on_v[:3], strict=True)]
    n_x = on_x.radius.shape[1]
    multiplier, excess = np.empty(together[2].shape), np.empty(together[2].shape)
    given = (*passes.cost, *together, n_x, v, passes.u, multiplier, excess, passes.price)
    starts = [(np.zeros_like(v), settings.max_interior_steps)]
    if guess is not None:
        starts.insert(0, (guess, settings.max_interior_steps // 3))
    total, near = 0, False
    for start, most in starts:
        v[:] = start
        iterations, near = method(*given, most, settings.tolerance)
        total += iterations
        if near:
            break
    on_x.multiplier[1:], on_v.multiplier[:] = multiplier[:, :n_x], multiplier[:, n_x:]
    if near:
        # by as little as can be
        _widen(on_x.radius[1:], excess[:, :n_x])
        _widen(on_v.radius, excess[:, n_x:])
    return total, near


def _polish(passes: _Passes, settings: Settings) -> tuple[int, bool]:
    """Makes passes from where the interior point method ended, and takes back what is worse.

    Returns:
        How many, and whether they ended at an optimum.
    """
    v, on_x, on_v = passes.v, passes.on_x, passes.on_v
    inside = v.copy(), on_x.multiplier.copy(), on_v.multiplier.copy()
    made, ended = passes.sweep(settings.max_sweeps, settings.max_halvings)
    if not ended:
        v[:] = inside[0]
    if not ended or not passes.are_within_price:
        on_x.multiplier[:], on_v.multiplier[:] = inside[1:]
    return made, ended


def _widen(radius: FloatArray, excess: FloatArray) -> None:
    """Widens bounds (T,K) in place to √(φ² + 2 φ t), those with no excess t not at all."""
    wide = excess > 0.0
    radius[wide] = np.sqrt(radius[wide] * (radius[wide] + 2.0 * excess[wide]))


def _about(matrix: FloatArray, offset: FloatArray, radius: FloatArray, first: int) -> _Bounds:
    """Returns bounds of which nothing is measured yet."""
    shape = radius.shape
    return _Bounds(
        np.ascontiguousarray(matrix),
        np.ascontiguousarray(offset),
        np.array(radius, dtype=np.float64, order="C"),
        first,
        np.zeros((*shape, 3)),
        np.zeros(shape),
        np.full(shape, -np.inf),
        np.zeros(shape, dtype=np.bool_),
        np.zeros(shape),
    )


def feedback_gains(problem: LocalProblem, solution: LocalSolution) -> FloatArray:
    """Returns (N,m,n) ∂v/∂x about a solution, along the bounds that are active there.

    It is a backward pass with all n states, not only those m that the inputs reach: what is
    measured between two solves need not lie among them.
    """
    p = problem
    steps, m = p.input_weight.shape
    n = len(p.start)
    on_x = _at(p.state_bounds, solution.x, solution.state_multiplier)
    on_v = _at(p.input_bounds, solution.v, solution.input_multiplier)
    hessian = np.zeros((steps + 1, n, n))
    hessian[:, range(n), range(n)] = 2.0 * p.state_weight
    # gains do not depend on slopes, which only move the feedforward
    x_slope, v_slope = np.zeros((steps + 1, n)), np.zeros((steps, m))
    rows = on_x.radius.shape[1] + on_v.radius.shape[1] + n
    backward: Any = _backward
    r = 2.0 * p.input_weight
    dropped = 1
    while dropped:
        law = _room(steps, n, m, rows)
        dropped = backward(p.input_matrix, hessian, r, x_slope, v_slope, on_x, on_v, law)
        rows += dropped
    gain: FloatArray = law.gain
    return gain


def _at(bounds: NormBounds, z: FloatArray, multiplier: FloatArray) -> _Bounds:
    """Returns bounds about a solution `z` (T,d)."""
    found = _about(bounds.matrix, bounds.offset, bounds.radius, 0)
    measure: Any = _measure
    measure(found, z)
    found.active[:] = multiplier > 0.0
    found.multiplier[:] = multiplier
    return found


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _room(steps, n, m, rows):  # type: ignore[no-untyped-def]
    """Returns a law to be filled, for N = `steps`, with `rows` active bounds a step at the most."""
    return _Law(
        np.zeros((steps, m, n)),
        np.zeros((steps, m)),
        np.empty((steps, m, m)),
        np.empty((steps, m, n)),
        np.empty((steps, m)),
        np.zeros(steps, np.int64),
        np.zeros((steps, rows, 2), np.int64),
        np.empty((steps, m, m + n + 1)),
        np.zeros(steps, np.int64),
        np.zeros((steps, rows, m)),
        np.zeros((steps, rows), np.int64),
        np.zeros((steps, rows)),
    )


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _measure(bounds, z):  # type: ignore[no-untyped-def]
    """Fills unit vectors, lengths and excesses of the bounds at `z` (T,d).

    Returns:
        The sum of what is beyond a bound.
    """
    matrix, normal, size, excess = bounds.matrix, bounds.normal, bounds.size, bounds.excess
    total = 0.0
    for t in range(bounds.first, matrix.shape[0]):
        for k in range(matrix.shape[1]):
            if bounds.radius[t, k] == np.inf:
                excess[t, k] = -np.inf
                continue
            length2 = 0.0
            for a in range(3):
                y = bounds.offset[t, k, a]
                for b in range(z.shape[1]):
                    y += matrix[t, k, a, b] * z[t, b]
                normal[t, k, a] = y
                length2 += y * y
            length = np.sqrt(length2)
            size[t, k] = length
            if length > 0.0:
                for a in range(3):
                    normal[t, k, a] /= length
            excess[t, k] = length - bounds.radius[t, k]
            total += max(excess[t, k], 0.0)
    return total


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _excess(bounds, z):  # type: ignore[no-untyped-def]
    """Returns the sum of what is beyond a bound at `z` (T,d), and fills nothing."""
    total = 0.0
    for t in range(bounds.first, bounds.matrix.shape[0]):
        for k in range(bounds.matrix.shape[1]):
            if bounds.radius[t, k] == np.inf:
                continue
            length2 = 0.0
            for a in range(3):
                y = bounds.offset[t, k, a]
                for b in range(z.shape[1]):
                    y += bounds.matrix[t, k, a, b] * z[t, b]
                length2 += y * y
            total += max(np.sqrt(length2) - bounds.radius[t, k], 0.0)
    return total


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _evaluate(cost, x, v, x_slope, v_slope):  # type: ignore[no-untyped-def]
    """Fills slopes w x + w_x (N+1,n) and r v + r_v (N,m); returns the cost."""
    w, w_x, r, r_v = cost
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
    """Fills states x_{t+1} = x_t + b v_t (N+1,n) from zero."""
    n, m = b.shape
    x[0] = 0.0
    for t in range(v.shape[0]):
        for a in range(n):
            s = x[t, a]
            for c in range(m):
                s += b[a, c] * v[t, c]
            x[t + 1, a] = s


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _backward(b, w, r, x_slope, v_slope, on_x, on_v, law):  # type: ignore[no-untyped-def]
    """Fills the law of each step, the last one first.

    Args:
        b: (n,m) of the dynamics x_{t+1} = x_t + b v_t.
        w: (N+1,n,n) Hessians of the cost of states.
        r: (N,m) diagonal ones of the cost of inputs.
        x_slope: (N+1,n) slopes of the cost along the trajectory.
        v_slope: (N,m) likewise.
        on_x: bounds on states, measured along it.
        on_v: bounds on inputs, likewise.
        law: filled.

    Returns:
        How many rows found no room in the law: if any, fill another one with room for them.
    """
    n, m = b.shape
    dropped = 0
    steps, most_rows = law.owner.shape
    p_xx, p_x = np.zeros((n, n)), np.zeros(n)
    rows, residual = np.empty((most_rows, m + n + 1)), np.empty((most_rows, m + n + 1))
    both = np.empty((m, n + 1))
    for i in range(steps - 1, -1, -1):
        for a in range(n):
            p_x[a] += x_slope[i + 1, a]
            for e in range(n):
                p_xx[a, e] += w[i + 1, a, e]
        _bend(on_x, i + 1, p_xx)
        _act(b, p_xx, p_x, r[i], v_slope[i], law, i)
        _bend(on_v, i, law.q_vv[i])
        # `residual` still is that of the step after
        number, without_room = _gather(b, on_x, on_v, law, i, residual, rows)
        dropped += without_room
        law.rank[i] = split_rows(
            rows, number, m, law.basis[i], residual, law.owner[i], law.coefficient[i]
        )
        _hand_over(rows, residual, number, m, law.owner[i], law.carried[i])
        _decide(law, i, both)
        _cost_to_go(law, i, both, p_xx, p_x)
    return dropped


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _bend(bounds, t, hessian):  # type: ignore[no-untyped-def]
    """Adds the curvature of active bounds at time `t`, weighted by their multipliers."""
    for k in range(bounds.active.shape[1]):
        size, multiplier = bounds.size[t, k], bounds.multiplier[t, k]
        if bounds.active[t, k] and multiplier > 0.0 and size > 0.0:
            add_curvature(bounds.matrix[t, k], bounds.normal[t, k], multiplier / size, hessian)


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _act(b, p_xx, p_x, r, v_slope, law, i):  # type: ignore[no-untyped-def]
    """Fills the derivatives of the action value (Eq. VQ-define); the state is an integrator."""
    n, m = b.shape
    q_vv, q_vx, q_v = law.q_vv[i], law.q_vx[i], law.q_v[i]
    for a in range(n):
        for c in range(m):
            s = 0.0
            for e in range(n):
                s += p_xx[a, e] * b[e, c]
            q_vx[c, a] = s
    for c in range(m):
        s = v_slope[c]
        for a in range(n):
            s += b[a, c] * p_x[a]
        q_v[c] = s
        for e in range(c + 1):
            s = 0.0
            for a in range(n):
                s += b[a, c] * q_vx[e, a]
            q_vv[c, e] = s
            q_vv[e, c] = s
        q_vv[c, c] += r[c]


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _gather(b, on_x, on_v, law, i, handed, rows):  # type: ignore[no-untyped-def]
    """Fills rows [g_v | g_x | g] of what is to hold after step `i`.

    Returns how many, and for how many more there is no room.

    They are active bounds on its input and on the state that it leads to (Eq.
    current-constraint), and what the step after could not keep by itself (Eq. future-constraint).
    A row for the state x_{i+1} is one for x_i, and by `b` one for v_i.
    """
    n, m = b.shape
    steps, most_rows = law.owner.shape
    source = law.source[i]
    number, without_room = 0, 0
    for k in range(on_v.active.shape[1]):
        if on_v.active[i, k] and number == most_rows:
            without_room += 1
        elif on_v.active[i, k]:
            for c in range(m):
                s = 0.0
                for a in range(3):
                    s += on_v.matrix[i, k, a, c] * on_v.normal[i, k, a]
                rows[number, c] = s
            for a in range(n):
                rows[number, m + a] = 0.0
            rows[number, m + n] = on_v.excess[i, k]
            source[number, 0], source[number, 1] = 0, k
            number += 1
    on_input = number
    for k in range(on_x.active.shape[1]):
        if on_x.active[i + 1, k] and number == most_rows:
            without_room += 1
        elif on_x.active[i + 1, k]:
            for e in range(n):
                s = 0.0
                for a in range(3):
                    s += on_x.matrix[i + 1, k, a, e] * on_x.normal[i + 1, k, a]
                rows[number, m + e] = s
            rows[number, m + n] = on_x.excess[i + 1, k]
            source[number, 0], source[number, 1] = 1, k
            number += 1
    if i + 1 < steps:
        for k in range(law.number[i + 1]):
            scale = law.carried[i + 1, k]
            if law.owner[i + 1, k] >= 0 or scale == 0.0:
                continue
            if number == most_rows:
                without_room += 1
                continue
            for a in range(n + 1):
                rows[number, m + a] = handed[k, m + a] / scale
            source[number, 0], source[number, 1] = 2, k
            number += 1
    for k in range(on_input, number):
        for c in range(m):
            s = 0.0
            for a in range(n):
                s += rows[k, m + a] * b[a, c]
            rows[k, c] = s
    law.number[i] = number
    return number, without_room


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _hand_over(rows, residual, count, m, owner, carried):  # type: ignore[no-untyped-def]
    """Fills the size of what rows ask of the state and no input can change; 0 where it is none."""
    state = slice(m, rows.shape[1] - 1)
    for k in range(count):
        carried[k] = 0.0
        if owner[k] < 0:
            left, whole = _square(residual[k, state]), _square(rows[k, state])
            if left > 1e-16 * max(whole, 1e-8):
                carried[k] = np.sqrt(left)


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _square(row):  # type: ignore[no-untyped-def]
    s = 0.0
    for a in range(row.shape[0]):
        s += row[a] ** 2
    return s


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _decide(law, i, both):  # type: ignore[no-untyped-def]
    """Fills gain and feedforward: what the rows ask of the input, and the best across them.

    `both` (m,n+1) is filled with [Q_vx | Q_v] + Q_vv [gain | feedforward].
    """
    m, n = law.q_vx[i].shape
    basis, size, q_vv = law.basis[i], law.rank[i], law.q_vv[i]
    found, free = np.empty((m, n + 1)), np.empty((m, m))
    for c in range(m):
        for a in range(n + 1):
            s = 0.0
            for k in range(size):
                s -= basis[k, c] * basis[k, m + a]
            found[c, a] = s
    across = complete_basis(basis, size, m, free)
    _slopes(law, i, found, both)
    if across > 0:
        reduced, right = np.empty((m, m)), np.empty((m, n + 1))
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
                        t += q_vv[c, d] * free[e, d]
                    s += free[k, c] * t
                reduced[k, e] = s
        solve_positive_definite(reduced, across, right, n + 1)
        for c in range(m):
            for a in range(n + 1):
                s = found[c, a]
                for k in range(across):
                    s += free[k, c] * right[k, a]
                found[c, a] = s
        _slopes(law, i, found, both)
    for c in range(m):
        for a in range(n):
            law.gain[i, c, a] = found[c, a]
        law.feedforward[i, c] = found[c, n]


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _slopes(law, i, found, both):  # type: ignore[no-untyped-def]
    """Fills `both` (m,n+1) with [Q_vx | Q_v] + Q_vv `found`."""
    m, n = law.q_vx[i].shape
    for c in range(m):
        for a in range(n + 1):
            s = law.q_vx[i, c, a] if a < n else law.q_v[i, c]
            for e in range(m):
                s += law.q_vv[i, c, e] * found[e, a]
            both[c, a] = s


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _cost_to_go(law, i, both, p_xx, p_x):  # type: ignore[no-untyped-def]
    """Turns the cost-to-go at x_{i+1} into that at x_i under the law."""
    m, n = law.q_vx[i].shape
    gain, feedforward, q_vx = law.gain[i], law.feedforward[i], law.q_vx[i]
    for a in range(n):
        for e in range(a + 1):
            s = p_xx[a, e]
            for c in range(m):
                s += gain[c, a] * both[c, e] + q_vx[c, a] * gain[c, e]
            p_xx[a, e] = s
            p_xx[e, a] = s
        s = p_x[a]
        for c in range(m):
            s += gain[c, a] * both[c, n] + q_vx[c, a] * feedforward[c]
        p_x[a] = s


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _forward(b, law, dx, dv, x_multiplier, v_multiplier):  # type: ignore[no-untyped-def]
    """Fills the new trajectory's distance to the old one, and the multipliers of active bounds.

    Args:
        b: (n,m) of the dynamics.
        law: of the backward pass.
        dx: (N+1,n), filled.
        dv: (N,m), filled.
        x_multiplier: (N+1,K), filled; zero where not active.
        v_multiplier: (N,L), likewise.
    """
    n, m = b.shape
    steps, most_rows = law.owner.shape
    multiplier, handed = np.zeros(most_rows), np.zeros(most_rows)
    slope = np.empty(m)
    x_multiplier[:] = 0.0
    v_multiplier[:] = 0.0
    dx[0] = 0.0
    for i in range(steps):
        for c in range(m):
            s = law.feedforward[i, c]
            for a in range(n):
                s += law.gain[i, c, a] * dx[i, a]
            dv[i, c] = s
        for a in range(n):
            s = dx[i, a]
            for c in range(m):
                s += b[a, c] * dv[i, c]
            dx[i + 1, a] = s
        for c in range(m):
            s = law.q_v[i, c]
            for a in range(n):
                s += law.q_vx[i, c, a] * dx[i, a]
            for e in range(m):
                s += law.q_vv[i, c, e] * dv[i, e]
            slope[c] = s
        _balance(law, i, slope, handed, multiplier)
        handed[:] = 0.0
        for k in range(law.number[i]):
            kind, which = law.source[i, k, 0], law.source[i, k, 1]
            if kind == 0:
                v_multiplier[i, which] = multiplier[k]
            elif kind == 1:
                x_multiplier[i + 1, which] = multiplier[k]
            else:
                handed[which] = multiplier[k] / law.carried[i + 1, which]


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _balance(law, i, slope, handed, multiplier):  # type: ignore[no-untyped-def]
    """Fills the multipliers of the rows of step `i`: they hold the action value's `slope` (m,).

    Rows that no input changes have the multiplier that the step before has `handed` on.
    """
    basis, coefficient, owner = law.basis[i], law.coefficient[i], law.owner[i]
    for k in range(law.number[i]):
        multiplier[k] = handed[k] if owner[k] < 0 else 0.0
    for j in range(law.rank[i] - 1, -1, -1):
        s = 0.0
        for c in range(slope.shape[0]):
            s -= basis[j, c] * slope[c]
        pivot = -1
        for k in range(law.number[i]):
            if owner[k] == j:
                pivot = k
            elif owner[k] < 0 or owner[k] > j:
                s -= coefficient[k, j] * multiplier[k]
        multiplier[pivot] = s / coefficient[pivot, j]


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _judge(bounds, dz, found, linear):  # type: ignore[no-untyped-def]
    """Fills what the linear bounds say of a step.

    Args:
        bounds: measured before it.
        dz: (T,d) the step.
        found: (T,K) multipliers of the forward pass.
        linear: (T,K) excesses, filled.

    Returns:
        The largest multiplier, the least one, and the largest excess of a bound that is not active.
    """
    largest, least, beyond = 0.0, 0.0, 0.0
    for t in range(bounds.first, linear.shape[0]):
        for k in range(linear.shape[1]):
            s = bounds.excess[t, k]
            linear[t, k] = s
            if s == -np.inf:
                continue
            if bounds.active[t, k]:
                largest, least = max(largest, found[t, k]), min(least, found[t, k])
                continue
            for e in range(dz.shape[1]):
                along = 0.0
                for a in range(3):
                    along += bounds.normal[t, k, a] * bounds.matrix[t, k, a, e]
                s += along * dz[t, e]
            linear[t, k] = s
            beyond = max(beyond, s)
    return largest, least, beyond


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _begin(bounds):  # type: ignore[no-untyped-def]
    """Makes bounds active that had a multiplier, or that the trajectory reaches."""
    for t in range(bounds.first, bounds.active.shape[0]):
        for k in range(bounds.active.shape[1]):
            reached = bounds.excess[t, k] > -_TOLERANCE
            bounds.active[t, k] = bounds.multiplier[t, k] > 0.0 or reached


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _switch(bounds, found, excess):  # type: ignore[no-untyped-def]
    """Lets bounds go whose multiplier is not positive, and takes in those that are exceeded."""
    for t in range(bounds.first, bounds.active.shape[0]):
        for k in range(bounds.active.shape[1]):
            if bounds.active[t, k]:
                bounds.active[t, k] = found[t, k] > 0.0
            else:
                bounds.active[t, k] = excess[t, k] > _TOLERANCE


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _accept(bounds, found):  # type: ignore[no-untyped-def]
    """Takes the multipliers of the forward pass."""
    for t in range(bounds.first, found.shape[0]):
        for k in range(found.shape[1]):
            bounds.multiplier[t, k] = max(0.0, found[t, k])


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _along(slope, step):  # type: ignore[no-untyped-def]
    """Returns Σ slope · step, and the largest component of the step."""
    total, size = 0.0, 0.0
    for t in range(step.shape[0]):
        for a in range(step.shape[1]):
            total += slope[t, a] * step[t, a]
            size = max(size, abs(step[t, a]))
    return total, size


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _sweep(cost, on_x, on_v, v, x, max_sweeps, max_halvings):  # type: ignore[no-untyped-def]
    """Sweeps from inputs `v` (N,m) and multipliers until they are optimal.

    The dynamics are x_{t+1} = x_t + v_t with x_0 = 0, all of m; `x` (N+1,m) is filled.

    Returns:
        Sweeps, and whether they ended at an optimum.
    """
    steps, m = v.shape
    room = on_x.radius.shape[1] + on_v.radius.shape[1] + m
    law = _room(steps, m, m, room)
    b = np.eye(m)
    x_new, v_new, dx, dv = np.empty_like(x), np.empty_like(v), np.zeros_like(x), np.zeros_like(v)
    x_slope, v_slope = np.zeros_like(x), np.zeros_like(v)
    x_scratch, v_scratch = np.empty_like(x), np.empty_like(v)
    x_linear, v_linear = np.empty_like(on_x.radius), np.empty_like(on_v.radius)
    x_found, v_found = np.zeros_like(on_x.radius), np.zeros_like(on_v.radius)

    _roll(b, v, x)
    excess = _measure(on_x, x) + _measure(on_v, v)
    value = _evaluate(cost, x, v, x_slope, v_slope)
    _begin(on_x)
    _begin(on_v)
    price = 0.0
    for sweep in range(1, max_sweeps + 1):
        dropped = _backward(b, cost.w, cost.r, x_slope, v_slope, on_x, on_v, law)
        while dropped > 0:
            room += dropped
            law = _room(steps, m, m, room)
            dropped = _backward(b, cost.w, cost.r, x_slope, v_slope, on_x, on_v, law)
        _forward(b, law, dx, dv, x_found, v_found)
        x_largest, x_least, x_beyond = _judge(on_x, dx, x_found, x_linear)
        v_largest, v_least, v_beyond = _judge(on_v, dv, v_found, v_linear)
        largest, beyond = max(x_largest, v_largest), max(x_beyond, v_beyond)
        # the active set is that of the quadratic programme: then the step leads down
        rounding = _ROUNDING * max(largest, 1e-6)
        consistent = min(x_least, v_least) > -rounding and beyond < _TOLERANCE
        price = max(price, 1.5 * largest)
        x_along, x_size = _along(x_slope, dx)
        v_along, v_size = _along(v_slope, dv)
        slope = x_along + v_along - price * excess
        merit = value + price * excess
        factor, accepted = 1.0, False
        for _ in range(max_halvings if consistent else 1):
            for t in range(steps):
                for c in range(m):
                    v_new[t, c] = v[t, c] + factor * dv[t, c]
            _roll(b, v_new, x_new)
            new_value = _evaluate(cost, x_new, v_new, x_scratch, v_scratch)
            new = new_value + price * (_excess(on_x, x_new) + _excess(on_v, v_new))
            allowed = 1e-4 * factor * min(slope, 0.0) + 1e-12 * (1.0 + abs(merit))
            accepted = new <= merit + allowed
            if accepted:
                break
            factor *= 0.5
        if accepted:
            v[:] = v_new
            x[:] = x_new
            excess = _measure(on_x, x) + _measure(on_v, v)
            value = _evaluate(cost, x, v, x_slope, v_slope)
            _accept(on_x, x_found)
            _accept(on_v, v_found)
            _switch(on_x, x_found, on_x.excess)
            _switch(on_v, v_found, on_v.excess)
            if consistent and factor == 1.0 and max(x_size, v_size) < _SMALLEST_STEP:
                return sweep, True
        elif consistent:
            return sweep, False
        else:
            # the same trajectory again, with other bounds
            _switch(on_x, x_found, x_linear)
            _switch(on_v, v_found, v_linear)
    return max_sweeps, False
