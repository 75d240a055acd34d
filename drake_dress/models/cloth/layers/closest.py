"""Closest points of a node and a triangle, and of two edges, as signed weights of four nodes.

A pair is four nodes and a kind. The weights sum to zero and give the vector between the closest
points, Σ c_i x_i, from the second part (triangle, second edge) to the first (node, first edge).
Both parts are convex, so a plane perpendicular to that vector separates them: `separation` along
the unit vector is the distance itself.
"""

from __future__ import annotations

import numba as nb
import numpy as np

NODE_TRIANGLE = 0
EDGE_EDGE = 1
# Squared sine of the angle below which two edges count as parallel.
_PARALLEL = 1e-10
# Squared sine of the angle at a corner below which a triangle counts as a line.
_FLAT = 1e-12


@nb.njit(cache=True, nogil=True)
def closest(x, kind, pair, weights):  # type: ignore[no-untyped-def]
    """Writes the weights (4,) of the closest points of `pair` (4,) at positions `x` (n,3), m."""
    if kind == NODE_TRIANGLE:
        _node_triangle(x, pair, weights)
    else:
        _edge_edge(x, pair, weights)


@nb.njit(cache=True, nogil=True)
def offset(x, pair, weights):  # type: ignore[no-untyped-def]
    """Returns the three components of Σ c_i x_i."""
    a, b, c, d = pair[0], pair[1], pair[2], pair[3]
    w0, w1, w2, w3 = weights[0], weights[1], weights[2], weights[3]
    return (
        w0 * x[a, 0] + w1 * x[b, 0] + w2 * x[c, 0] + w3 * x[d, 0],
        w0 * x[a, 1] + w1 * x[b, 1] + w2 * x[c, 1] + w3 * x[d, 1],
        w0 * x[a, 2] + w1 * x[b, 2] + w2 * x[c, 2] + w3 * x[d, 2],
    )


@nb.njit(cache=True, nogil=True)
def separation(x, kind, pair, nx, ny, nz):  # type: ignore[no-untyped-def]
    """Returns the gap of the two parts along a unit vector, m, and the two corners that bound it.

    If it is positive, a plane across the vector lies between them. Corners are indices in `pair`.
    """
    a, b, c, d = pair[0], pair[1], pair[2], pair[3]
    h0 = nx * x[a, 0] + ny * x[a, 1] + nz * x[a, 2]
    h1 = nx * x[b, 0] + ny * x[b, 1] + nz * x[b, 2]
    h2 = nx * x[c, 0] + ny * x[c, 1] + nz * x[c, 2]
    h3 = nx * x[d, 0] + ny * x[d, 1] + nz * x[d, 2]
    upper, low = 0, h0
    under, high = 2, h2
    if h3 > high:
        under, high = 3, h3
    if kind == NODE_TRIANGLE:
        if h1 > high:
            under, high = 1, h1
    elif h1 < low:
        upper, low = 1, h1
    return low - high, upper, under


@nb.njit(cache=True, nogil=True)
def _node_triangle(x, pair, weights):  # type: ignore[no-untyped-def]
    """Uses the foot of the perpendicular if it lies inside, else the closest of the three sides."""
    p, i, j, k = pair[0], pair[1], pair[2], pair[3]
    ab0, ab1, ab2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
    ac0, ac1, ac2 = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
    ap0, ap1, ap2 = x[p, 0] - x[i, 0], x[p, 1] - x[i, 1], x[p, 2] - x[i, 2]
    d1 = ab0 * ap0 + ab1 * ap1 + ab2 * ap2
    d2 = ac0 * ap0 + ac1 * ap1 + ac2 * ap2
    bb = ab0 * ab0 + ab1 * ab1 + ab2 * ab2
    bc = ab0 * ac0 + ab1 * ac1 + ab2 * ac2
    cc = ac0 * ac0 + ac1 * ac1 + ac2 * ac2
    determinant = bb * cc - bc * bc
    u, v = -1.0, -1.0
    if determinant > _FLAT * bb * cc:
        u = (cc * d1 - bc * d2) / determinant
        v = (bb * d2 - bc * d1) / determinant
    if u < 0.0 or v < 0.0 or u + v > 1.0:
        u, v = _on_border(d1, d2, bb, bc, cc)
    weights[0] = 1.0
    weights[1] = -(1.0 - u - v)
    weights[2] = -u
    weights[3] = -v


@nb.njit(cache=True, nogil=True)
def _on_border(d1, d2, bb, bc, cc):  # type: ignore[no-untyped-def]
    """Returns the closest point on the three sides as weights of second and third corner."""
    best = np.inf
    u, v = 0.0, 0.0
    for side in range(3):
        # from (1, 0) or (0, 0), toward (0, 1) or (1, 0)
        if side == 0:
            s = min(1.0, max(0.0, d1 / bb)) if bb > 0.0 else 0.0
            p, q = s, 0.0
        elif side == 1:
            s = min(1.0, max(0.0, d2 / cc)) if cc > 0.0 else 0.0
            p, q = 0.0, s
        else:
            size = bb - 2.0 * bc + cc
            s = min(1.0, max(0.0, (d2 - d1 + bb - bc) / size)) if size > 0.0 else 0.0
            p, q = 1.0 - s, s
        # squared distance, less that of the first corner
        distance2 = p * p * bb + 2.0 * p * q * bc + q * q * cc - 2.0 * (p * d1 + q * d2)
        if distance2 < best:
            best, u, v = distance2, p, q
    return u, v


@nb.njit(cache=True, nogil=True)
def _edge_edge(x, pair, weights):  # type: ignore[no-untyped-def]
    """Uses the lines' closest points if both lie within, else the best of the four ends."""
    i, j, k, l = pair[0], pair[1], pair[2], pair[3]
    u0, u1, u2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
    v0, v1, v2 = x[l, 0] - x[k, 0], x[l, 1] - x[k, 1], x[l, 2] - x[k, 2]
    r0, r1, r2 = x[i, 0] - x[k, 0], x[i, 1] - x[k, 1], x[i, 2] - x[k, 2]
    a = u0 * u0 + u1 * u1 + u2 * u2
    e = v0 * v0 + v1 * v1 + v2 * v2
    b = u0 * v0 + u1 * v1 + u2 * v2
    c = u0 * r0 + u1 * r1 + u2 * r2
    f = v0 * r0 + v1 * r1 + v2 * r2
    s, t = -1.0, -1.0
    denominator = a * e - b * b
    if denominator > _PARALLEL * a * e:
        s = (b * f - c * e) / denominator
        t = (a * f - b * c) / denominator
    if not (0.0 < s < 1.0 and 0.0 < t < 1.0):
        best = np.inf
        for end in range(4):
            if end < 2:
                s_end = float(end)
                t_end = 0.0
                if e > 0.0:
                    t_end = min(1.0, max(0.0, (f + s_end * b) / e))
            else:
                t_end = float(end - 2)
                s_end = 0.0
                if a > 0.0:
                    s_end = min(1.0, max(0.0, (t_end * b - c) / a))
            g0 = r0 + s_end * u0 - t_end * v0
            g1 = r1 + s_end * u1 - t_end * v1
            g2 = r2 + s_end * u2 - t_end * v2
            distance2 = g0 * g0 + g1 * g1 + g2 * g2
            if distance2 < best:
                best, s, t = distance2, s_end, t_end
    weights[0] = 1.0 - s
    weights[1] = s
    weights[2] = -(1.0 - t)
    weights[3] = -t
