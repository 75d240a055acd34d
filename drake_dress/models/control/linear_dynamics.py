"""Compiled loops for linear dynamics: x_{t+1} = a_t x_t + b_t v_t.

`a` is None for integrators, x_{t+1} = x_t + b_t v_t. `b` is None for the identity, with n = m.
"""

from __future__ import annotations

import numba as nb
import numpy as np


@nb.njit(cache=True, nogil=True, error_model="numpy")
def roll(a, b, v, x):  # type: ignore[no-untyped-def]
    """Fills the states `x` (N+1,n) that result from inputs `v` (N,m) and x_0 = 0."""
    x[0] = 0.0
    for t in range(v.shape[0]):
        advance(a, b, t, x[t], v[t], x[t + 1])


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def advance(a, b, t, x, v, after):  # type: ignore[no-untyped-def]
    """Fills the state `after` (n,) step `t`, from state `x` (n,) and input `v` (m,)."""
    for i in range(x.shape[0]):
        s = x[i]
        if a is not None:
            s = 0.0
            for e in range(x.shape[0]):
                s += a[t, i, e] * x[e]
        if b is None:
            s += v[i]
        else:
            for c in range(v.shape[0]):
                s += b[t, i, c] * v[c]
        after[i] = s


@nb.njit(nogil=True, error_model="numpy", forceinline=True)
def pull_back(a, row):  # type: ignore[no-untyped-def]
    """Replaces a `row` (n,) in the state after a step by the row in the state before: row · a."""
    n = row.shape[0]
    before = np.empty(n)
    for e in range(n):
        s = 0.0
        for d in range(n):
            s += row[d] * a[d, e]
        before[e] = s
    for e in range(n):
        row[e] = before[e]
