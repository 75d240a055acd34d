"""Compiled passes of constrained DDP; constrained_ddp.py explains the method.

The dynamics are x_{t+1} = a_t x_t + b_t v_t. `a` is None for integrators: x_{t+1} = x_t + b_t v_t.
"""

from __future__ import annotations

from typing import NamedTuple

import numba as nb
import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.control.linear_dynamics import advance, pull_back, roll
from drake_dress.models.control.small_matrices import (
    add_curvature,
    complete_basis,
    solve_positive_definite,
    split_rows,
)

# Excess of a bound, m or m/s, below which the bound counts as satisfied.
_TOLERANCE = 1e-9
# Change of states and inputs below which the sweeps have converged.
_SMALLEST_STEP = 1e-7
# Rounding error of multipliers, relative to the largest.
_ROUNDING = 1e-9


class QuadraticCost(NamedTuple):
    """Σ ½ xᵀw x + w_xᵀx + ½ vᵀr v + r_vᵀv over a trajectory: (N+1,n,n), (N+1,n), (N,m), (N,m)."""

    w: FloatArray
    w_x: FloatArray
    r: FloatArray
    r_v: FloatArray


class MeasuredBounds(NamedTuple):
    """Norm bounds ‖C z + d‖ ≤ φ on states or inputs, evaluated along a trajectory.

    Attributes:
        matrix, offset, radius: C (T,K,3,d), d (T,K,3), φ (T,K).
        first: time step of the first bound that counts; the initial state is fixed.
        normal, size, excess: unit vector and length of C z + d, (T,K,3) and (T,K); ‖C z + d‖ − φ.
        active, multiplier: active set and multipliers, (T,K).
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


class FeedbackLaw(NamedTuple):
    """Result of the backward pass for each step, and input of the forward pass.

    Attributes:
        gain, feedforward: δv = gain δx + feedforward, (N,m,n) and (N,m).
        q_vv, q_vx, q_v: derivatives of the action-value function, (N,m,m), (N,m,n), (N,m).
        number: (N,) number of constraint rows, including those that the next step passed back.
        source: (N,R,2) origin of a row: 0, 1, 2 for a bound on inputs, a bound on states, a row of
            the next step; and its index there.
        basis, rank, coefficient, owner: decomposition of the rows, see `split_rows`.
        carried: (N,R) norm of what is passed to the preceding step; 0 if nothing is.
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


@nb.njit(cache=True, nogil=True, error_model="numpy")
def room(steps, n, m, rows):  # type: ignore[no-untyped-def]
    """Allocates a law for N = `steps`, with at most `rows` constraint rows per step."""
    return FeedbackLaw(
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
def measure(bounds, z):  # type: ignore[no-untyped-def]
    """Fills unit vectors, lengths and excesses of the bounds at `z` (T,d).

    Returns:
        The sum of all positive excesses.
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
    """Returns the sum of all positive excesses at `z` (T,d), without filling `bounds`."""
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
    """Fills the gradients w x + w_x (N+1,n) and r v + r_v (N,m); returns the cost."""
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
def backward(a, b, w, r, x_slope, v_slope, on_x, on_v, law):  # type: ignore[no-untyped-def]
    """Fills the law of each step, from the last step to the first.

    Args:
        a: (N,n,n) of the dynamics; None for integrators.
        b: (N,n,m) of the dynamics.
        w: (N+1,n,n) Hessians of the state cost.
        r: (N,m) diagonal Hessians of the input cost.
        x_slope: (N+1,n) gradients of the state cost along the trajectory.
        v_slope: (N,m) gradients of the input cost along it.
        on_x: bounds on states, evaluated along it.
        on_v: bounds on inputs, likewise.
        law: filled.

    Returns:
        The number of rows that did not fit into the law. If positive, repeat with a larger law.
    """
    _, n, m = b.shape
    dropped = 0
    steps, most_rows = law.owner.shape
    p_xx, p_x = np.zeros((n, n)), np.zeros(n)
    rows, residual = np.empty((most_rows, m + n + 1)), np.empty((most_rows, m + n + 1))
    both = np.empty((m, n + 1))
    for i in range(steps - 1, -1, -1):
        for c in range(n):
            p_x[c] += x_slope[i + 1, c]
            for e in range(n):
                p_xx[c, e] += w[i + 1, c, e]
        _bend(on_x, i + 1, p_xx)
        _act(a, b, p_xx, p_x, r[i], v_slope[i], law, i)
        _bend(on_v, i, law.q_vv[i])
        # `residual` still holds that of the next step
        number, without_room = _gather(a, b, on_x, on_v, law, i, residual, rows)
        dropped += without_room
        law.rank[i] = split_rows(
            rows, number, m, law.basis[i], residual, law.owner[i], law.coefficient[i]
        )
        _hand_over(rows, residual, number, m, law.owner[i], law.carried[i])
        _decide(law, i, both)
        _cost_to_go(a, law, i, both, p_xx, p_x)
    return dropped


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _bend(bounds, t, hessian):  # type: ignore[no-untyped-def]
    """Adds the curvature of active bounds at time step `t`, weighted by their multipliers."""
    for k in range(bounds.active.shape[1]):
        size, multiplier = bounds.size[t, k], bounds.multiplier[t, k]
        if bounds.active[t, k] and multiplier > 0.0 and size > 0.0:
            add_curvature(bounds.matrix[t, k], bounds.normal[t, k], multiplier / size, hessian)


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _act(a, b, p_xx, p_x, r, v_slope, law, i):  # type: ignore[no-untyped-def]
    """Fills the derivatives of the action-value function (Eq. VQ-define)."""
    _, n, m = b.shape
    q_vv, q_vx, q_v = law.q_vv[i], law.q_vx[i], law.q_v[i]
    for d in range(n):
        for c in range(m):
            s = 0.0
            for e in range(n):
                s += p_xx[d, e] * b[i, e, c]
            q_vx[c, d] = s
    for c in range(m):
        s = v_slope[c]
        for d in range(n):
            s += b[i, d, c] * p_x[d]
        q_v[c] = s
        for e in range(c + 1):
            s = 0.0
            for d in range(n):
                s += b[i, d, c] * q_vx[e, d]
            q_vv[c, e] = s
            q_vv[e, c] = s
        q_vv[c, c] += r[c]
    if a is not None:
        for c in range(m):
            pull_back(a[i], q_vx[c])


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _gather(a, b, on_x, on_v, law, i, handed, rows):  # type: ignore[no-untyped-def]
    """Fills the constraint rows [g_v | g_x | g] of step `i`.

    Returns their number, and the number of rows that did not fit.

    The rows are active bounds on the step's input and on the resulting state (Eq.
    current-constraint), and constraints that the next step passed back (Eq. future-constraint).
    A row in x_{i+1} becomes a row in x_i through `a`, and a row in v_i through `b`.
    """
    _, n, m = b.shape
    steps, most_rows = law.owner.shape
    source = law.source[i]
    number, without_room = 0, 0
    for k in range(on_v.active.shape[1]):
        if on_v.active[i, k] and number == most_rows:
            without_room += 1
        elif on_v.active[i, k]:
            for c in range(m):
                s = 0.0
                for d in range(3):
                    s += on_v.matrix[i, k, d, c] * on_v.normal[i, k, d]
                rows[number, c] = s
            for e in range(n):
                rows[number, m + e] = 0.0
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
                for d in range(3):
                    s += on_x.matrix[i + 1, k, d, e] * on_x.normal[i + 1, k, d]
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
            for e in range(n + 1):
                rows[number, m + e] = handed[k, m + e] / scale
            source[number, 0], source[number, 1] = 2, k
            number += 1
    for k in range(on_input, number):
        for c in range(m):
            s = 0.0
            for e in range(n):
                s += rows[k, m + e] * b[i, e, c]
            rows[k, c] = s
        if a is not None:
            pull_back(a[i], rows[k, m : m + n])
    law.number[i] = number
    return number, without_room


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _hand_over(rows, residual, count, m, owner, carried):  # type: ignore[no-untyped-def]
    """Fills the norm of the state part of rows that no input can change; 0 if there is none."""
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
    """Fills gain and feedforward: the rows fix one part of the input, the other part is optimal.

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
def _cost_to_go(a, law, i, both, p_xx, p_x):  # type: ignore[no-untyped-def]
    """Replaces the cost-to-go at x_{i+1} by that at x_i under the law."""
    m, n = law.q_vx[i].shape
    gain, feedforward, q_vx = law.gain[i], law.feedforward[i], law.q_vx[i]
    if a is not None:
        for d in range(n):
            pull_back(a[i], p_xx[d])
        for e in range(n):
            pull_back(a[i], p_xx[:, e])
        pull_back(a[i], p_x)
    for d in range(n):
        for e in range(d + 1):
            s = p_xx[d, e]
            for c in range(m):
                s += gain[c, d] * both[c, e] + q_vx[c, d] * gain[c, e]
            p_xx[d, e] = s
            p_xx[e, d] = s
        s = p_x[d]
        for c in range(m):
            s += gain[c, d] * both[c, n] + q_vx[c, d] * feedforward[c]
        p_x[d] = s


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _forward(a, b, law, dx, dv, x_multiplier, v_multiplier):  # type: ignore[no-untyped-def]
    """Fills the change of the trajectory, and the multipliers of active bounds.

    Args:
        a: (N,n,n) of the dynamics; None for integrators.
        b: (N,n,m) of the dynamics.
        law: result of the backward pass.
        dx: (N+1,n) change of the states, filled.
        dv: (N,m) change of the inputs, filled.
        x_multiplier: (N+1,K), filled; zero where not active.
        v_multiplier: (N,L), likewise.
    """
    _, n, m = b.shape
    steps, most_rows = law.owner.shape
    multiplier, handed = np.zeros(most_rows), np.zeros(most_rows)
    slope = np.empty(m)
    x_multiplier[:] = 0.0
    v_multiplier[:] = 0.0
    dx[0] = 0.0
    for i in range(steps):
        for c in range(m):
            s = law.feedforward[i, c]
            for e in range(n):
                s += law.gain[i, c, e] * dx[i, e]
            dv[i, c] = s
        advance(a, b, i, dx[i], dv[i], dx[i + 1])
        for c in range(m):
            s = law.q_v[i, c]
            for e in range(n):
                s += law.q_vx[i, c, e] * dx[i, e]
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
    """Fills the multipliers of the rows of step `i`, which balance the gradient `slope` (m,).

    `slope` is that of the action-value function. Rows that no input changes take the multiplier
    that the preceding step `handed` on.
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
    """Fills the linearized excesses of inactive bounds after a step.

    Args:
        bounds: evaluated before the step.
        dz: (T,d) the step.
        found: (T,K) multipliers of the forward pass.
        linear: (T,K) excesses, filled; those of active bounds are taken before the step.

    Returns:
        The largest and the least multiplier, and the largest excess of an inactive bound.
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
    """Activates bounds that have a positive multiplier or that the trajectory reaches."""
    for t in range(bounds.first, bounds.active.shape[0]):
        for k in range(bounds.active.shape[1]):
            reached = bounds.excess[t, k] > -_TOLERANCE
            bounds.active[t, k] = bounds.multiplier[t, k] > 0.0 or reached


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _switch(bounds, found, excess):  # type: ignore[no-untyped-def]
    """Deactivates bounds without a positive multiplier, and activates those that are exceeded."""
    for t in range(bounds.first, bounds.active.shape[0]):
        for k in range(bounds.active.shape[1]):
            if bounds.active[t, k]:
                bounds.active[t, k] = found[t, k] > 0.0
            else:
                bounds.active[t, k] = excess[t, k] > _TOLERANCE


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _accept(bounds, found):  # type: ignore[no-untyped-def]
    """Adopts the multipliers of the forward pass, at least zero."""
    for t in range(bounds.first, found.shape[0]):
        for k in range(found.shape[1]):
            bounds.multiplier[t, k] = max(0.0, found[t, k])


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _along(slope, step):  # type: ignore[no-untyped-def]
    """Returns Σ slope · step, and the largest absolute component of the step."""
    total, size = 0.0, 0.0
    for t in range(step.shape[0]):
        for a in range(step.shape[1]):
            total += slope[t, a] * step[t, a]
            size = max(size, abs(step[t, a]))
    return total, size


@nb.njit(cache=True, nogil=True, error_model="numpy")
def sweep(a, b, cost, on_x, on_v, v, x, max_sweeps, max_halvings):  # type: ignore[no-untyped-def]
    """Runs sweeps from inputs `v` (N,m) and multipliers until they are optimal.

    The dynamics start at x_0 = 0; `v` is updated in place and `x` (N+1,n) is filled.

    Returns:
        The number of sweeps, and whether they converged.
    """
    (steps, m), n = v.shape, x.shape[1]
    rows = on_x.radius.shape[1] + on_v.radius.shape[1] + n
    law = room(steps, n, m, rows)
    x_new, v_new, dx, dv = np.empty_like(x), np.empty_like(v), np.zeros_like(x), np.zeros_like(v)
    x_slope, v_slope = np.zeros_like(x), np.zeros_like(v)
    x_scratch, v_scratch = np.empty_like(x), np.empty_like(v)
    x_linear, v_linear = np.empty_like(on_x.radius), np.empty_like(on_v.radius)
    x_found, v_found = np.zeros_like(on_x.radius), np.zeros_like(on_v.radius)

    roll(a, b, v, x)
    excess = measure(on_x, x) + measure(on_v, v)
    value = _evaluate(cost, x, v, x_slope, v_slope)
    _begin(on_x)
    _begin(on_v)
    price = 0.0
    for made in range(1, max_sweeps + 1):
        dropped = backward(a, b, cost.w, cost.r, x_slope, v_slope, on_x, on_v, law)
        while dropped > 0:
            rows += dropped
            law = room(steps, n, m, rows)
            dropped = backward(a, b, cost.w, cost.r, x_slope, v_slope, on_x, on_v, law)
        _forward(a, b, law, dx, dv, x_found, v_found)
        x_largest, x_least, x_beyond = _judge(on_x, dx, x_found, x_linear)
        v_largest, v_least, v_beyond = _judge(on_v, dv, v_found, v_linear)
        largest, beyond = max(x_largest, v_largest), max(x_beyond, v_beyond)
        # with the active set of the quadratic programme, the step is a descent direction
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
            roll(a, b, v_new, x_new)
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
            excess = measure(on_x, x) + measure(on_v, v)
            value = _evaluate(cost, x, v, x_slope, v_slope)
            _accept(on_x, x_found)
            _accept(on_v, v_found)
            _switch(on_x, x_found, on_x.excess)
            _switch(on_v, v_found, on_v.excess)
            if consistent and factor == 1.0 and max(x_size, v_size) < _SMALLEST_STEP:
                return made, True
        elif consistent:
            return made, False
        else:
            # repeat from the same trajectory with another active set
            _switch(on_x, x_found, x_linear)
            _switch(on_v, v_found, v_linear)
    return max_sweeps, False
