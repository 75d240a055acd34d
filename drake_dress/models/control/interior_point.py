"""A primal-dual interior point method for the local problem: where the active set is not known.

The bounds are written c = (φ² − ‖y‖²) / 2φ ≥ 0 with slacks s; predictor and corrector follow
Mehrotra ("On the implementation of a primal-dual interior point method", 1992). Each Newton step is
a backward and a forward pass without bounds: they are barriers in the cost. The end is close to the
optimum and tells active bounds by multiplier > slack; constrained DDP goes the rest of the way.
"""

from __future__ import annotations

import numba as nb
import numpy as np

# Share of the way to the border of the positive numbers that a step may go.
_BORDER_SHARE = 0.995
# Slacks at first: at least this share of the bound, and this, m or m/s.
_FIRST_SHARE, _LEAST_SLACK = 0.1, 1e-4
# Growth of the products of slack and multiplier at which nothing obeys the bounds.
_DIVERGED = 1e12


@nb.njit(cache=True, nogil=True, error_model="numpy")
def interior_point(  # type: ignore[no-untyped-def]
    w,
    w_x,
    r,
    r_v,
    matrix,
    offset,
    radius,
    n_x,
    v,
    x,
    multiplier,
    max_iterations,
    tolerance,
):
    """Fills inputs, states and multipliers near the optimum.

    The dynamics are x_{t+1} = x_t + v_t with x_0 = 0, all of m.

    Args:
        w: (N+1,m,m) Hessians of the cost of states.
        w_x: (N+1,m) its slopes at zero.
        r: (N,m) diagonal Hessians of the cost of inputs.
        r_v: (N,m) its slopes at zero.
        matrix: (N,K+L,3,m) of the K bounds on the state that a step leads to, then of the L bounds
            on its input.
        offset: (N,K+L,3) of them.
        radius: (N,K+L); infinite where there is no bound.
        n_x: K.
        v: (N,m) inputs to start from, and on return.
        x: (N+1,m) on return.
        multiplier: (N,K+L) on return, of the norms; zero where not active.
        max_iterations: at most.
        tolerance: of bounds, and of products of slack and multiplier relative to the first.

    Returns:
        The iterations, and whether they sufficed. If not, the inputs are those that exceeded the
        bounds least, and the multipliers are zero.
    """
    steps, m = v.shape
    each = radius.shape[1]
    bounded = radius < np.inf
    count = max(bounded.sum(), 1)
    slope, value = np.zeros((steps, each, m)), np.zeros((steps, each))
    slack = np.ones((steps, each))
    multiplier[:] = 0.0
    complement = np.zeros((steps, each))
    d_slack, d_multiplier = np.zeros((steps, each)), np.zeros((steps, each))
    factor, gain = np.empty((steps, m, m)), np.empty((steps, m, m))
    dx, dv = np.zeros((steps + 1, m)), np.zeros((steps, m))
    best, least = v.copy(), np.inf

    _roll(v, x)
    _values(matrix, offset, radius, n_x, v, x, slope, value)
    steepness = 0.0
    for t in range(steps):
        for a in range(m):
            s = w_x[t + 1, a]
            for e in range(m):
                s += w[t + 1, a, e] * x[t + 1, e]
            steepness += abs(s)
    # products alike, and of the cost's order
    first = 0.1 * (steepness + 1e-6) / count
    for t in range(steps):
        for k in range(each):
            if bounded[t, k]:
                slack[t, k] = max(value[t, k], _FIRST_SHARE * radius[t, k], _LEAST_SLACK)
                multiplier[t, k] = first / slack[t, k]
    mu, done, iteration = first, False, 0
    while iteration < max_iterations:
        iteration += 1
        _factor(w, r, matrix, radius, n_x, slope, slack, multiplier, factor, gain)
        complement[:] = 0.0
        target = 0.0
        for phase in range(2):
            _newton(
                w, w_x, r, r_v, n_x, v, x, slope, value, slack, multiplier, bounded, complement,
                target, factor, gain, dx, dv,
            )  # fmt: skip
            primal, dual = _step_lengths(
                n_x, slope, value, slack, multiplier, bounded, complement, target, dx, dv,
                d_slack, d_multiplier,
            )  # fmt: skip
            if phase == 0:
                after = 0.0
                for t in range(steps):
                    for k in range(each):
                        if bounded[t, k]:
                            after += (slack[t, k] + primal * d_slack[t, k]) * (
                                multiplier[t, k] + dual * d_multiplier[t, k]
                            )
                            complement[t, k] = d_slack[t, k] * d_multiplier[t, k]
                target = mu * min(1.0, (after / (count * mu)) ** 3)
        for t in range(steps):
            for c in range(m):
                v[t, c] += primal * dv[t, c]
            for k in range(each):
                if bounded[t, k]:
                    slack[t, k] += primal * d_slack[t, k]
                    multiplier[t, k] += dual * d_multiplier[t, k]
        _roll(v, x)
        _values(matrix, offset, radius, n_x, v, x, slope, value)
        mu, mismatch, violation = 0.0, 0.0, 0.0
        for t in range(steps):
            for k in range(each):
                if bounded[t, k]:
                    mu += slack[t, k] * multiplier[t, k] / count
                    mismatch += abs(value[t, k] - slack[t, k])
                    violation = max(violation, -value[t, k])
        if not (mu < _DIVERGED * first and np.isfinite(mismatch)):
            break
        if violation <= max(least, tolerance):
            best[:], least = v, violation
        if mu <= tolerance * first and mismatch <= tolerance * count:
            done = True
            break
    if not done:
        v[:] = best
        _roll(v, x)
        multiplier[:] = 0.0
        return iteration, False
    # the slope of c is that of the norm where the bound is met
    for t in range(steps):
        for k in range(each):
            if multiplier[t, k] <= slack[t, k]:
                multiplier[t, k] = 0.0
    return iteration, True


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _roll(v, x):  # type: ignore[no-untyped-def]
    x[0] = 0.0
    for t in range(v.shape[0]):
        for c in range(v.shape[1]):
            x[t + 1, c] = x[t, c] + v[t, c]


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _values(matrix, offset, radius, n_x, v, x, slope, value):  # type: ignore[no-untyped-def]
    """Fills c (N,K+L) and −∂c/∂z (N,K+L,m) of all bounds."""
    steps, each = radius.shape
    m = v.shape[1]
    for t in range(steps):
        for k in range(each):
            if radius[t, k] == np.inf:
                continue
            z = x[t + 1] if k < n_x else v[t]
            length2 = 0.0
            for c in range(m):
                slope[t, k, c] = 0.0
            for a in range(3):
                y = offset[t, k, a]
                for c in range(m):
                    y += matrix[t, k, a, c] * z[c]
                for c in range(m):
                    slope[t, k, c] += matrix[t, k, a, c] * y / radius[t, k]
                length2 += y * y
            value[t, k] = 0.5 * (radius[t, k] - length2 / radius[t, k])


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _factor(w, r, matrix, radius, n_x, slope, slack, multiplier, factor, gain):  # type: ignore[no-untyped-def]
    """Backward pass of the Hessians: with q_vv = L Lᵀ, fills L and gain = L⁻¹p."""
    steps, each = radius.shape
    m = r.shape[1]
    p, of_input = np.zeros((m, m)), np.empty((m, m))
    for t in range(steps - 1, -1, -1):
        for a in range(m):
            for e in range(a + 1):
                p[a, e] += w[t + 1, a, e]
                of_input[a, e] = 0.0
            of_input[a, a] = r[t, a]
        for k in range(each):
            if radius[t, k] == np.inf:
                continue
            hessian = p if k < n_x else of_input
            curved = multiplier[t, k] / radius[t, k]
            barrier = multiplier[t, k] / slack[t, k]
            c0, c1, c2 = matrix[t, k, 0], matrix[t, k, 1], matrix[t, k, 2]
            for a in range(m):
                for e in range(a + 1):
                    hessian[a, e] += barrier * slope[t, k, a] * slope[t, k, e] + curved * (
                        c0[a] * c0[e] + c1[a] * c1[e] + c2[a] * c2[e]
                    )
        for a in range(m):
            for e in range(a):
                p[e, a] = p[a, e]
        for a in range(m):
            for e in range(a + 1):
                s = of_input[a, e] + p[a, e]
                for c in range(e):
                    s -= factor[t, a, c] * factor[t, e, c]
                factor[t, a, e] = np.sqrt(max(s, 1e-300)) if a == e else s / factor[t, e, e]
        for e in range(m):
            for a in range(m):
                s = p[a, e]
                for c in range(a):
                    s -= factor[t, a, c] * gain[t, c, e]
                gain[t, a, e] = s / factor[t, a, a]
        for a in range(m):
            for e in range(a + 1):
                s = p[a, e]
                for c in range(m):
                    s -= gain[t, c, a] * gain[t, c, e]
                p[a, e] = s


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _newton(  # type: ignore[no-untyped-def]
    w,
    w_x,
    r,
    r_v,
    n_x,
    v,
    x,
    slope,
    value,
    slack,
    multiplier,
    bounded,
    complement,
    target,
    factor,
    gain,
    dx,
    dv,
):
    """Fills the Newton step of states and inputs: slopes backward, then the law forward."""
    steps, each = bounded.shape
    m = v.shape[1]
    p, work = np.zeros(m), np.empty(m)
    half = np.empty((steps, m))
    for t in range(steps - 1, -1, -1):
        for a in range(m):
            s = w_x[t + 1, a]
            for e in range(m):
                s += w[t + 1, a, e] * x[t + 1, e]
            p[a] += s
            work[a] = r_v[t, a] + r[t, a] * v[t, a]
        for k in range(each):
            if bounded[t, k]:
                push = (
                    target - complement[t, k] - multiplier[t, k] * (value[t, k] - slack[t, k])
                ) / slack[t, k]
                into = p if k < n_x else work
                for a in range(m):
                    into[a] += push * slope[t, k, a]
        for a in range(m):
            s = work[a] + p[a]
            for c in range(a):
                s -= factor[t, a, c] * half[t, c]
            half[t, a] = s / factor[t, a, a]
        for a in range(m):
            s = p[a]
            for c in range(m):
                s -= gain[t, c, a] * half[t, c]
            p[a] = s
    dx[0] = 0.0
    for t in range(steps):
        for a in range(m):
            s = half[t, a]
            for c in range(m):
                s += gain[t, a, c] * dx[t, c]
            work[a] = s
        for a in range(m - 1, -1, -1):
            s = work[a]
            for c in range(a + 1, m):
                s -= factor[t, c, a] * work[c]
            work[a] = s / factor[t, a, a]
        for a in range(m):
            dv[t, a] = -work[a]
            dx[t + 1, a] = dx[t, a] - work[a]


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _step_lengths(  # type: ignore[no-untyped-def]
    n_x,
    slope,
    value,
    slack,
    multiplier,
    bounded,
    complement,
    target,
    dx,
    dv,
    d_slack,
    d_multiplier,
):
    """Fills the steps of slacks and multipliers; returns how far both may go."""
    steps, each = bounded.shape
    primal, dual = 1.0, 1.0
    for t in range(steps):
        for k in range(each):
            if not bounded[t, k]:
                continue
            dz = dx[t + 1] if k < n_x else dv[t]
            s = value[t, k] - slack[t, k]
            for a in range(len(dz)):
                s -= slope[t, k, a] * dz[a]
            change = (target - complement[t, k] - multiplier[t, k] * s) / slack[t, k]
            d_slack[t, k], d_multiplier[t, k] = s, change - multiplier[t, k]
            if s < 0.0:
                primal = min(primal, -_BORDER_SHARE * slack[t, k] / s)
            if d_multiplier[t, k] < 0.0:
                dual = min(dual, -_BORDER_SHARE * multiplier[t, k] / d_multiplier[t, k])
    return primal, dual
