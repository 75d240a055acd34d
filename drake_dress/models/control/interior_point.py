"""A primal-dual interior point method for the local problem, used if the active set is unknown.

The bounds are written c + t = s with c = (φ² − ‖y‖²) / 2φ, slack s ≥ 0 and excess t ≥ 0. The price
of t is above the multiplier of any feasible bound (an exact penalty). An optimum therefore always
exists, and infeasible bounds are violated by the smallest total amount. Predictor and corrector
follow Mehrotra ("On the implementation of a primal-dual interior point method", 1992). Each Newton
step is an unconstrained backward and forward pass, with the bounds as barriers in the cost. The
result is close to the optimum, and a bound is active if its multiplier exceeds its slack.
Constrained DDP then refines the result.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.control.linear_dynamics import advance, pull_back, roll

# Fraction of the distance to the boundary, where a variable becomes zero, that a step may go.
_BORDER_SHARE = 0.995
# Initial excess as a share of the bound.
_FIRST_EXCESS = 0.3
# Least centering target, relative to products that are small enough to stop.
_WAITING = 1e-4
# Least distance to the optimum that an initial guess is assumed to have, m.
_FLATTEST = 1e-3


@nb.njit(cache=True, nogil=True, error_model="numpy")
def interior_point(  # type: ignore[no-untyped-def]
    a,
    b,
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

    The dynamics are x_{t+1} = a_t x_t + b_t v_t with x_0 = 0.

    Args:
        a: (N,n,n), or None with `b`: then x_{t+1} = x_t + v_t and n = m.
        b: (N,n,m), or None.
        w: (N+1,n,n) Hessians of the state cost.
        w_x: (N+1,n) its gradients at zero.
        r: (N,m) diagonal Hessians of the input cost.
        r_v: (N,m) its gradients at zero.
        matrix: (N,K+L,3,max(n,m)) of the K bounds on the state after a step, then of the L bounds
            on its input; their first n and first m columns are used.
        offset: (N,K+L,3) of the bounds.
        radius: (N,K+L); infinite where there is no bound.
        n_x: number K of bounds on the state.
        v: (N,m) initial inputs; the result on return.
        x: (N+1,n) states on return.
        multiplier: (N,K+L) on return, of the norms; zero where not active.
        excess: (N,K+L) t on return, of infeasible bounds; zero elsewhere.
        price: penalty on the sum of excesses.
        max_iterations: iteration limit.
        tolerance: of the mean residual of the bounds, and of the mean product of slack and
            multiplier relative to the initial multiplier.

    Returns:
        The number of iterations, and whether the method converged.
    """
    (steps, m), n = v.shape, x.shape[1]
    each = radius.shape[1]
    bounded = radius < np.inf
    count = max(bounded.sum(), 1)
    slope, value = np.zeros((steps, each, max(n, m))), np.zeros((steps, each))
    slack, spare = np.ones((steps, each)), np.ones((steps, each))
    multiplier[:] = 0.0
    excess[:] = 0.0
    # second-order products of the predictor: slack and multiplier, excess and its own multiplier
    left, left_spare = np.zeros((steps, each)), np.zeros((steps, each))
    d_slack, d_excess = np.zeros((steps, each)), np.zeros((steps, each))
    d_multiplier = np.zeros((steps, each))
    factor, gain = np.empty((steps, m, m)), np.empty((steps, m, n))
    dx, dv = np.zeros((steps + 1, n)), np.zeros((steps, m))

    roll(a, b, v, x)
    _values(matrix, offset, radius, n_x, v, x, slope, value)
    steepness = 0.0
    for t in range(steps):
        for d in range(n):
            s = w_x[t + 1, d]
            for e in range(n):
                s += w[t + 1, d, e] * x[t + 1, e]
            steepness += abs(s) + _FLATTEST * w[t + 1, d, d]
    mu = 0.0
    for t in range(steps):
        for k in range(each):
            if bounded[t, k]:
                excess[t, k] = _FIRST_EXCESS * radius[t, k] + max(0.0, -value[t, k])
                slack[t, k] = value[t, k] + excess[t, k]
                # similar products for bounds of the usual size
                multiplier[t, k] = min(0.5 * price, steepness / count)
                spare[t, k] = price - multiplier[t, k]
                mu += slack[t, k] * multiplier[t, k] + excess[t, k] * spare[t, k]
    mu /= 2.0 * count
    enough = tolerance * max(steepness, 1e-9) / count
    done, iteration = False, 0
    while iteration < max_iterations and not done:
        iteration += 1
        _factor(
            a, b, w, r, matrix, radius, n_x, slope, slack, excess, multiplier, spare, factor, gain
        )
        left[:] = 0.0
        left_spare[:] = 0.0
        target = 0.0
        for phase in range(2):
            _newton(
                a, b, w, w_x, r, r_v, n_x, v, x, slope, value, slack, excess, multiplier, spare,
                bounded, left, left_spare, target, factor, gain, dx, dv,
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
                # Without bounds there is no centering. Products that are small enough must not
                # shrink further until all bounds are satisfied, or slacks would vanish first.
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
        roll(a, b, v, x)
        _values(matrix, offset, radius, n_x, v, x, slope, value)
        mu, mismatch = 0.0, 0.0
        for t in range(steps):
            for k in range(each):
                if bounded[t, k]:
                    mu += slack[t, k] * multiplier[t, k] + excess[t, k] * spare[t, k]
                    mismatch += abs(value[t, k] + excess[t, k] - slack[t, k])
        mu /= 2.0 * count
        done = mu <= enough and mismatch <= tolerance * count
    # On the boundary, c has the gradient of the norm up to sign, so its multipliers carry over.
    for t in range(steps):
        for k in range(each):
            if multiplier[t, k] <= slack[t, k]:
                multiplier[t, k] = 0.0
            if excess[t, k] <= spare[t, k]:
                excess[t, k] = 0.0
    return iteration, done


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _values(matrix, offset, radius, n_x, v, x, slope, value):  # type: ignore[no-untyped-def]
    """Fills c (N,K+L) and −∂c/∂z (N,K+L,max(n,m)) of all bounds."""
    steps, each = radius.shape
    for t in range(steps):
        for k in range(each):
            if radius[t, k] == np.inf:
                continue
            z = x[t + 1] if k < n_x else v[t]
            length2 = 0.0
            for c in range(len(z)):
                slope[t, k, c] = 0.0
            for d in range(3):
                y = offset[t, k, d]
                for c in range(len(z)):
                    y += matrix[t, k, d, c] * z[c]
                for c in range(len(z)):
                    slope[t, k, c] += matrix[t, k, d, c] * y / radius[t, k]
                length2 += y * y
            value[t, k] = 0.5 * (radius[t, k] - length2 / radius[t, k])


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _factor(  # type: ignore[no-untyped-def]
    a, b, w, r, matrix, radius, n_x, slope, slack, excess, multiplier, spare, factor, gain
):
    """Backward pass of the Hessians: with q_vv = L Lᵀ, fills L and gain = L⁻¹ q_vx."""
    steps, each = radius.shape
    m, n = gain.shape[1], gain.shape[2]
    p, of_input = np.zeros((n, n)), np.empty((m, m))
    q_vv, q_vx = np.empty((m, m)), np.empty((m, n))
    for t in range(steps - 1, -1, -1):
        for c in range(n):
            for e in range(c + 1):
                p[c, e] += w[t + 1, c, e]
        for c in range(m):
            for e in range(c + 1):
                of_input[c, e] = 0.0
            of_input[c, c] = r[t, c]
        for k in range(each):
            if radius[t, k] == np.inf:
                continue
            hessian = p if k < n_x else of_input
            curved = multiplier[t, k] / radius[t, k]
            barrier = 1.0 / (slack[t, k] / multiplier[t, k] + excess[t, k] / spare[t, k])
            c0, c1, c2 = matrix[t, k, 0], matrix[t, k, 1], matrix[t, k, 2]
            for c in range(hessian.shape[0]):
                for e in range(c + 1):
                    hessian[c, e] += barrier * slope[t, k, c] * slope[t, k, e] + curved * (
                        c0[c] * c0[e] + c1[c] * c1[e] + c2[c] * c2[e]
                    )
        for c in range(n):
            for e in range(c):
                p[e, c] = p[c, e]
        _through_dynamics(a, b, t, p, q_vv, q_vx)
        for c in range(m):
            for e in range(c + 1):
                s = of_input[c, e] + q_vv[c, e]
                for d in range(e):
                    s -= factor[t, c, d] * factor[t, e, d]
                factor[t, c, e] = np.sqrt(max(s, 1e-300)) if c == e else s / factor[t, e, e]
        for e in range(n):
            for c in range(m):
                s = q_vx[c, e]
                for d in range(c):
                    s -= factor[t, c, d] * gain[t, d, e]
                gain[t, c, e] = s / factor[t, c, c]
        for c in range(n):
            for e in range(c + 1):
                s = p[c, e]
                for d in range(m):
                    s -= gain[t, d, c] * gain[t, d, e]
                p[c, e] = s


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _through_dynamics(a, b, t, p, q_vv, q_vx):  # type: ignore[no-untyped-def]
    """Fills q_vv = bᵀ p b and q_vx = bᵀ p a, and replaces the Hessian p (n,n) by aᵀ p a."""
    m, n = q_vx.shape
    if a is None:
        q_vv[:] = p
        q_vx[:] = p
    else:
        pa, pb = p @ a[t], p @ b[t]
        for c in range(m):
            for e in range(m):
                s = 0.0
                for d in range(n):
                    s += b[t, d, c] * pb[d, e]
                q_vv[c, e] = s
            for e in range(n):
                s = 0.0
                for d in range(n):
                    s += b[t, d, c] * pa[d, e]
                q_vx[c, e] = s
        for c in range(n):
            for e in range(n):
                s = 0.0
                for d in range(n):
                    s += a[t, d, c] * pa[d, e]
                p[c, e] = s


@nb.njit(cache=True, nogil=True, error_model="numpy")
def _newton(  # type: ignore[no-untyped-def]
    a,
    b,
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
    """Fills the Newton step of states and inputs: gradients backward, then the law forward."""
    steps, each = bounded.shape
    m, n = v.shape[1], x.shape[1]
    p, work, into_v = np.zeros(n), np.empty(m), np.empty(m)
    half = np.empty((steps, m))
    for t in range(steps - 1, -1, -1):
        for d in range(n):
            s = w_x[t + 1, d]
            for e in range(n):
                s += w[t + 1, d, e] * x[t + 1, e]
            p[d] += s
        for c in range(m):
            work[c] = r_v[t, c] + r[t, c] * v[t, c]
        for k in range(each):
            if bounded[t, k]:
                push = multiplier[t, k] + (
                    (target - left[t, k]) / multiplier[t, k]
                    - (target - left_spare[t, k]) / spare[t, k]
                    - value[t, k]
                ) / (slack[t, k] / multiplier[t, k] + excess[t, k] / spare[t, k])
                into = p if k < n_x else work
                for c in range(into.shape[0]):
                    into[c] += push * slope[t, k, c]
        _slope_through_dynamics(a, b, t, p, into_v)
        for c in range(m):
            s = work[c] + into_v[c]
            for d in range(c):
                s -= factor[t, c, d] * half[t, d]
            half[t, c] = s / factor[t, c, c]
        for e in range(n):
            s = p[e]
            for c in range(m):
                s -= gain[t, c, e] * half[t, c]
            p[e] = s
    dx[0] = 0.0
    for t in range(steps):
        for c in range(m):
            s = half[t, c]
            for e in range(n):
                s += gain[t, c, e] * dx[t, e]
            work[c] = s
        for c in range(m - 1, -1, -1):
            s = work[c]
            for d in range(c + 1, m):
                s -= factor[t, d, c] * work[d]
            work[c] = s / factor[t, c, c]
        for c in range(m):
            dv[t, c] = -work[c]
        advance(a, b, t, dx[t], dv[t], dx[t + 1])


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def _slope_through_dynamics(a, b, t, p, into_v):  # type: ignore[no-untyped-def]
    """Fills `into_v` with bᵀ p, and replaces the gradient p (n,) by aᵀ p."""
    if a is None:
        into_v[:] = p
    else:
        n = p.shape[0]
        for c in range(into_v.shape[0]):
            s = 0.0
            for d in range(n):
                s += b[t, d, c] * p[d]
            into_v[c] = s
        pull_back(a[t], p)


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
    """Fills the steps of slacks, excesses and multipliers; returns primal and dual step length."""
    steps, each = bounded.shape
    primal, dual = 1.0, 1.0
    for t in range(steps):
        for k in range(each):
            if not bounded[t, k]:
                continue
            dz = dx[t + 1] if k < n_x else dv[t]
            along = 0.0
            for c in range(len(dz)):
                along += slope[t, k, c] * dz[c]
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
