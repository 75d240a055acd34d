"""The limited-memory BFGS direction for a given first guess of the inverse Hessian.

With pairs s = change of x, y = change of the gradient over the last iterations, the two-loop
recursion (Nocedal and Wright, "Numerical Optimization", alg. 7.4) turns a gradient into a
direction. Between the loops it applies the first guess, which the caller gives: Projective Dynamics
uses the factor of its constant matrix (Liu, Bouaziz and Kavan 2017, "Quasi-Newton methods for
real-time simulation of hyperelastic materials").
"""

from __future__ import annotations

from collections.abc import Callable

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.vectors import dot

# A pair is kept if s·y is above this share of ‖s‖ ‖y‖: without curvature it has no inverse.
_LEAST_CURVATURE = 1e-8


class CurvatureHistory:
    """The last pairs and the direction that they give.

    Args:
        window: number of pairs kept.
        node_count: n.
    """

    def __init__(self, window: int, node_count: int) -> None:
        self._s = np.zeros((window, node_count, 3))
        self._y = np.zeros((window, node_count, 3))
        self._inverse = np.zeros(window)
        self._order: list[int] = []

    def clear(self) -> None:
        """Forgets all pairs."""
        self._order.clear()

    def add(self, s: FloatArray, y: FloatArray) -> None:
        """Adds the pair (n,3), (n,3) of the last iteration; drops the oldest if full."""
        along, s2, y2 = _pair_products(s, y)
        if along <= _LEAST_CURVATURE * np.sqrt(s2 * y2):
            return
        full = len(self._order) == len(self._inverse)
        slot = self._order.pop(0) if full else len(self._order)
        self._s[slot], self._y[slot], self._inverse[slot] = s, y, 1.0 / along
        self._order.append(slot)

    def direction(
        self, gradient: FloatArray, first_guess: Callable[[FloatArray], FloatArray]
    ) -> FloatArray:
        """Returns −B⁻¹ gradient (n,3); `first_guess` multiplies (n,3) by the initial B⁻¹."""
        order = np.array(self._order, dtype=np.int64)
        q = -gradient
        alpha = np.zeros(len(order))
        _first_loop(order, self._s, self._y, self._inverse, q, alpha)
        z = first_guess(q)
        _second_loop(order, self._s, self._y, self._inverse, z, alpha)
        return z


@nb.njit(cache=True, nogil=True)
def _pair_products(s, y):  # type: ignore[no-untyped-def]
    return dot(s, y), dot(s, s), dot(y, y)


@nb.njit(cache=True, nogil=True)
def _first_loop(order, s, y, inverse, q, alpha):  # type: ignore[no-untyped-def]
    for k in range(order.shape[0] - 1, -1, -1):
        m = order[k]
        alpha[k] = inverse[m] * dot(s[m], q)
        for i in range(q.shape[0]):
            for c in range(3):
                q[i, c] -= alpha[k] * y[m, i, c]


@nb.njit(cache=True, nogil=True)
def _second_loop(order, s, y, inverse, z, alpha):  # type: ignore[no-untyped-def]
    for k in range(order.shape[0]):
        m = order[k]
        beta = alpha[k] - inverse[m] * dot(y[m], z)
        for i in range(z.shape[0]):
            for c in range(3):
                z[i, c] += beta * s[m, i, c]
