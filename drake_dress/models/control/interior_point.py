"""A primal-dual interior point method for the local problem: where the active set is not known.

The bounds are written c + t = s with c = (φ² − ‖y‖²) / 2φ, slack s ≥ 0 and excess t ≥ 0 at a price
that no bound which can be kept is worth: there always is an optimum, and bounds that nothing keeps
are exceeded by the least sum. Predictor and corrector follow Mehrotra ("On the implementation of a
primal-dual interior point method", 1992). Each Newton step is a backward and a forward pass without
bounds: they are barriers in the cost. The end is close to the optimum and tells active bounds by
multiplier > slack; constrained DDP goes the rest of the way.
"""

from __future__ import annotations

import numba as nb
import numpy as np

# Share of the way to the border of the positive numbers that a step may go.
_BORDER_SHARE = 0.995
# Excess at first as a share of the bound.
_FIRST_EXCESS = 0.3
# Way from the optimum, m, that a start is taken to have at least.
# Of products that are small enough, to what they are brought at most.
_WAITING = 1e-4
_FLATTEST = 1e-3


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
    excess,
    price,
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
        excess: (N,K+L) t on return, of bounds that nothing keeps; zero elsewhere.
        price: of the sum of excesses.
        max_iterations: after which it gives up.
        tolerance: of bounds, and of products of slack and multiplier relative to the first.

    Returns:
        The iterations, and whether they sufficed.
    """
    steps, m = v.shape
    each = radius.shape[1]
    bounded = radius < np.inf
    count = max(bounded.sum(), 1)
    slope, value = np.zeros((steps, each, m)), np.zeros((steps, each))
    slack, spare = np.ones((steps, each)), np.ones((steps, each))
    multiplier[:] = 0.0
    excess[:] = 0.0
    # products that the predictor leaves behind: of slack and multiplier, of excess and its own
    left, left_spare = np.zeros((steps, each)), np.zeros((steps, each))
    d_slack, d_excess = np.zeros((steps, each)), np.zeros((steps, each))
    d_multiplier = np.zeros((steps, each))
    factor, gain = np.empty((steps, m, m)), np.empty((steps, m, m))
    dx, dv = np.zeros((steps + 1, m)), np.zeros((steps, m))

    _roll(v, x)
    _values(matrix, offset, radius, n_x, v, x, slope, value)
    steepness = 0.0
    for t in range(steps):
        for a in range(m):
            s = w_x[t + 1, a]
            for e in range(m):
                s += w[t + 1, a, e] * x[t + 1, e]
            steepness += abs(s) + _FLATTEST * w[t + 1, a, a]
    mu = 0.0
    for t in range(steps):
        for k in range(each):
            if bounded[t, k]:
                excess[t, k] = _FIRST_EXCESS * radius[t, k] + max(0.0, -value[t, k])
                slack[t, k] = value[t, k] + excess[t, k]
                # products alike for a bound of the usual size
                multiplier[t, k] = min(0.5 * price, steepness / count)
                spare[t, k] = price - multiplier[t, k]
                mu += slack[t, k] * multiplier[t, k] + excess[t, k] * spare[t, k]
    mu /= 2.0 * count
    enough = tolerance * max(steepness, 1e-9) / count
    done, iteration = False, 0
    while iteration < max_iterations and not done:
        iteration += 1
        _factor(w, r, matrix, radius, n_x, slope, slack, excess, multiplier, spare, factor, gain)
        left[:] = 0.0
        left_spare[:] = 0.0
        target = 0.0
        for phase in range(2):
            _newton(
                w, w_x, r, r_v, n_x, v, x, slope, value, slack, excess, multiplier, spare, bounded,
                left, left_spare, target, factor, gain, dx, dv,
            )  # fmt: skip
            primal, dual = _step_lengths(
                n_x, slope, value, slack, excess, multiplier, spare, bounded, left, left_spare,
                target, dx, dv, d_slack, d_excess, d_multiplier,
            )  # fmt: skip
            if phase == 0:
                after = 0.0
                for t in range(steps):
                    for k in range(each):
                        if bounded[t, k]:
                            change = dual * d_multiplier[t, k]
                            after += (slack[t, k] + primal * d_slack[t, k]) * (
                                multiplier[t, k] + change
                            ) + (excess[t, k] + primal * d_excess[t, k]) * (spare[t, k] - change)
                            left[t, k] = d_slack[t, k] * d_multiplier[t, k]
                            left_spare[t, k] = -d_excess[t, k] * d_multiplier[t, k]
                # without any bound there is nothing to be central to; products that are small
                # enough wait for bounds that are not kept yet, or slacks vanish before these are
                if mu > 0.0:
                    target = mu * min(1.0, (after / (2.0 * count * mu)) ** 3)
                    target = max(target, _WAITING * enough)
        for t in range(steps):
            for c in range(m):
                v[t, c] += primal * dv[t, c]
            for k in range(each):
                if bounded[t, k]:
                    slack[t, k] += primal * d_slack[t, k]
                    excess[t, k] += primal * d_excess[t, k]
                    multiplier[t, k] += dual * d_multiplier[t, k]
                    spare[t, k] -= dual * d_multiplier[t, k]
        _roll(v, x)
        _values(matrix, offset, radius, n_x, v, x, slope, value)
        mu, mismatch = 0.0, 0.0
        for t in range(steps):
            for k in range(each):
                if bounded[t, k]:
                    mu += slack[t, k] * multiplier[t, k] + excess[t, k] * spare[t, k]
                    mismatch += abs(value[t, k] + excess[t, k] - slack[t, k])
        mu /= 2.0 * count
        done = mu <= enough and mismatch <= tolerance * count
    # the slope of c is that of the norm where the bound is met
    for t in range(steps):
        for k in range(each):
            if multiplier[t, k] <= slack[t, k]:
                multiplier[t, k] = 0.0
            if excess[t, k] <= spare[t, k]:
                excess[t, k] = 0.0
    return iteration, done


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
def _factor(  # type: ignore[no-untyped-def]
    w, r, matrix, radius, n_x, slope, slack, excess, multiplier, spare, factor, gain
):
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
            barrier = 1.0 / (slack[t, k] / multiplier[t, k] + excess[t, k] / spare[t, k])
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
    excess,
    multiplier,
    spare,
    bounded,
    left,
    left_spare,
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
                push = multiplier[t, k] + (
                    (target - left[t, k]) / multiplier[t, k]
                    - (target - left_spare[t, k]) / spare[t, k]
                    - value[t, k]
                ) / (slack[t, k] / multiplier[t, k] + excess[t, k] / spare[t, k])
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
    excess,
    multiplier,
    spare,
    bounded,
    left,
    left_spare,
    target,
    dx,
    dv,
    d_slack,
    d_excess,
    d_multiplier,
):
    """Fills the steps of slacks, excesses and multipliers; returns how far they may go."""
    steps, each = bounded.shape
    primal, dual = 1.0, 1.0
    for t in range(steps):
        for k in range(each):
            if not bounded[t, k]:
                continue
            dz = dx[t + 1] if k < n_x else dv[t]
            along = 0.0
            for a in range(len(dz)):
                along += slope[t, k, a] * dz[a]
            of_slack = (target - left[t, k]) / multiplier[t, k]
            of_excess = (target - left_spare[t, k]) / spare[t, k]
            ratio = slack[t, k] / multiplier[t, k]
            ratio_spare = excess[t, k] / spare[t, k]
            change = (along - value[t, k] - of_excess + of_slack) / (ratio + ratio_spare)
            d_multiplier[t, k] = change
            d_slack[t, k] = of_slack - slack[t, k] - ratio * change
            d_excess[t, k] = of_excess - excess[t, k] + ratio_spare * change
            if d_slack[t, k] < 0.0:
                primal = min(primal, -_BORDER_SHARE * slack[t, k] / d_slack[t, k])
            if d_excess[t, k] < 0.0:
                primal = min(primal, -_BORDER_SHARE * excess[t, k] / d_excess[t, k])
            if change < 0.0:
                dual = min(dual, -_BORDER_SHARE * multiplier[t, k] / change)
            elif change > 0.0:
                dual = min(dual, _BORDER_SHARE * spare[t, k] / change)
    return primal, dual
