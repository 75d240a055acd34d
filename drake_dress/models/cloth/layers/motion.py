"""A displacement without its rigid part.

The rigid part is the best-fitting twist t + ω × r. It is linear in r, and the symmetric part of
r + ω × r is the identity, so no distance shrinks along it. The distance of a pair can therefore
shrink at most by the relative motion that is left without it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.layers.topology import Topology


@dataclass(frozen=True)
class Motion:
    """A displacement without its rigid part.

    Attributes:
        rest: (n,3) the displacement less the best-fitting twist, m.
        spread: (n,) largest motion of a node's neighbours relative to it, m.
        reach: (n,) length of `rest` plus `spread`, m.
        longest: (n,) squared length of the longest edge at a node, m².
        turn: angle of the twist, rad.
    """

    rest: FloatArray
    spread: FloatArray
    reach: FloatArray
    longest: FloatArray
    turn: float


def relative_motion(topology: Topology, x: FloatArray, dx: FloatArray) -> Motion:
    """Returns the displacement `dx` (n,3), m, of nodes at `x` (n,3), m, without its twist."""
    rest = np.empty_like(x)
    n = len(x)
    reach, spread, longest = np.empty(n), np.empty(n), np.empty(n)
    turn = _take_off_twist(x, dx, rest)
    _edge_spread(x, rest, topology.edge, reach, spread, longest)
    return Motion(rest, spread, reach, longest, turn)


@nb.njit(cache=True, nogil=True)
def _take_off_twist(x, dx, rest):  # type: ignore[no-untyped-def]
    n = x.shape[0]
    c = np.zeros(3)
    m = np.zeros(3)
    for i in range(n):
        for k in range(3):
            c[k] += x[i, k]
            m[k] += dx[i, k]
    c /= max(n, 1)
    m /= max(n, 1)
    xx = yy = zz = xy = xz = yz = 0.0
    l0 = l1 = l2 = 0.0
    for i in range(n):
        r0, r1, r2 = x[i, 0] - c[0], x[i, 1] - c[1], x[i, 2] - c[2]
        u0, u1, u2 = dx[i, 0] - m[0], dx[i, 1] - m[1], dx[i, 2] - m[2]
        xx += r0 * r0
        yy += r1 * r1
        zz += r2 * r2
        xy += r0 * r1
        xz += r0 * r2
        yz += r1 * r2
        l0 += r1 * u2 - r2 * u1
        l1 += r2 * u0 - r0 * u2
        l2 += r0 * u1 - r1 * u0
    # Slightly increased inertia, because nodes on a line have none about it.
    more = 1e-9 * (xx + yy + zz) + 1e-300
    a00, a11, a22 = yy + zz + more, xx + zz + more, xx + yy + more
    a01, a02, a12 = -xy, -xz, -yz
    k00 = a11 * a22 - a12 * a12
    k01 = a02 * a12 - a01 * a22
    k02 = a01 * a12 - a02 * a11
    k11 = a00 * a22 - a02 * a02
    k12 = a01 * a02 - a00 * a12
    k22 = a00 * a11 - a01 * a01
    determinant = a00 * k00 + a01 * k01 + a02 * k02
    w0 = (k00 * l0 + k01 * l1 + k02 * l2) / determinant
    w1 = (k01 * l0 + k11 * l1 + k12 * l2) / determinant
    w2 = (k02 * l0 + k12 * l1 + k22 * l2) / determinant
    for i in range(n):
        r0, r1, r2 = x[i, 0] - c[0], x[i, 1] - c[1], x[i, 2] - c[2]
        rest[i, 0] = dx[i, 0] - m[0] - (w1 * r2 - w2 * r1)
        rest[i, 1] = dx[i, 1] - m[1] - (w2 * r0 - w0 * r2)
        rest[i, 2] = dx[i, 2] - m[2] - (w0 * r1 - w1 * r0)
    return np.sqrt(w0 * w0 + w1 * w1 + w2 * w2)


@nb.njit(cache=True, nogil=True)
def _edge_spread(x, rest, edge, reach, spread, longest):  # type: ignore[no-untyped-def]
    spread[:] = 0.0
    longest[:] = 0.0
    for k in range(edge.shape[0]):
        i, j = edge[k, 0], edge[k, 1]
        size = 0.0
        apart = 0.0
        for m in range(3):
            size += (x[i, m] - x[j, m]) ** 2
            apart += (rest[i, m] - rest[j, m]) ** 2
        longest[i] = max(longest[i], size)
        longest[j] = max(longest[j], size)
        spread[i] = max(spread[i], apart)
        spread[j] = max(spread[j], apart)
    for i in range(x.shape[0]):
        spread[i] = np.sqrt(spread[i])
        reach[i] = spread[i] + np.sqrt(rest[i, 0] ** 2 + rest[i, 1] ** 2 + rest[i, 2] ** 2)
