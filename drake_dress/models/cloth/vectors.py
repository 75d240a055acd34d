"""Sums and lengths of arrays of vectors.

Sums run on whole vector registers, in an order that the compiler chooses.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray

_SUMS = {"reassoc", "contract"}


@nb.njit(cache=True, nogil=True, fastmath=_SUMS, forceinline=True)
def dot(a: FloatArray, b: FloatArray) -> float:
    """Returns Σ a b of two C-contiguous arrays of one shape."""
    p, q = a.reshape(-1), b.reshape(-1)
    total = 0.0
    for i in range(p.shape[0]):
        total += p[i] * q[i]
    return total


@nb.njit(cache=True, nogil=True, fastmath=_SUMS, forceinline=True)
def add(a: FloatArray, scale: float, b: FloatArray) -> None:
    """Adds `scale` times `b` to `a`, in place."""
    p, q = a.reshape(-1), b.reshape(-1)
    for i in range(p.shape[0]):
        p[i] += scale * q[i]


@nb.njit(cache=True, nogil=True, fastmath=_SUMS, forceinline=True)
def turn(direction: FloatArray, beta: float, ahead: FloatArray) -> None:
    """Writes `ahead` + β `direction` to `direction`: the next conjugate search direction."""
    p, q = direction.reshape(-1), ahead.reshape(-1)
    for i in range(p.shape[0]):
        p[i] = q[i] + beta * p[i]


@nb.njit(cache=True, nogil=True)
def largest_length(v: FloatArray) -> float:
    """Returns the largest length of a row of `v` (n,3)."""
    largest = 0.0
    for i in range(v.shape[0]):
        largest = max(largest, v[i, 0] ** 2 + v[i, 1] ** 2 + v[i, 2] ** 2)
    return np.sqrt(largest)
