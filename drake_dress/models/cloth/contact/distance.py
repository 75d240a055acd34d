"""Signed distances, normals and their derivatives, as compiled kernels.

Shapes come packed as a tuple of plain arrays (`Obstacles.packed`), so that kernels take all of them
as one argument. Limbs are round cones (`models/round_cone.py`); with equal radii they are capsules.
"""

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray

# A distance larger than any that occurs, m.
_FAR = 1e9
# Rounding error of distances, m.
_ROUNDING = 1e-9
# Distance at which a point on its path counts as touching, m; steps after which a grazing path is
# given up.
TOUCH = 1e-5
MOST_MARCHES = 64


@nb.njit(cache=True, nogil=True, inline="always")
def _round_cone(p0, p1, p2, a, b, cone, m):  # type: ignore[no-untyped-def]
    """Returns signed distance and segment parameter of a point to round cone m."""
    d0, d1, d2 = b[m, 0] - a[m, 0], b[m, 1] - a[m, 1], b[m, 2] - a[m, 2]
    q0, q1, q2 = p0 - a[m, 0], p1 - a[m, 1], p2 - a[m, 2]
    length2 = d0 * d0 + d1 * d1 + d2 * d2
    t = 0.0
    if length2 > 0.0:
        t = (q0 * d0 + q1 * d1 + q2 * d2) / length2
        # a capsule leans nowhere and is spared the square root
        if cone[m, 2] != 0.0:
            r0, r1, r2 = q0 - t * d0, q1 - t * d1, q2 - t * d2
            t += cone[m, 2] * np.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
        t = min(1.0, max(0.0, t))
    r0, r1, r2 = q0 - t * d0, q1 - t * d1, q2 - t * d2
    return np.sqrt(r0 * r0 + r1 * r1 + r2 * r2) - (cone[m, 0] + t * cone[m, 1]), t


@nb.njit(cache=True, nogil=True)
def _weights(t, w, d, c):  # type: ignore[no-untyped-def]
    """Writes the four cubic B-spline weights at t in [0, 1), first and second derivatives."""
    s = 1.0 - t
    w[0] = s * s * s / 6.0
    w[1] = (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0
    w[2] = (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0
    w[3] = t * t * t / 6.0
    d[0] = -0.5 * s * s
    d[1] = 0.5 * (3.0 * t * t - 4.0 * t)
    d[2] = -0.5 * (3.0 * s * s - 4.0 * s)
    d[3] = 0.5 * t * t
    c[0] = s
    c[1] = 3.0 * t - 2.0
    c[2] = 3.0 * s - 2.0
    c[3] = t


@nb.njit(cache=True, nogil=True)
def _solid(p0, p1, p2, solids, m, gradient, hessian, order):  # type: ignore[no-untyped-def]
    """Returns the distance to solid m; writes world gradient (3,), Hessian (3,3) up to `order`.

    Outside the grid: the distance at the nearest point of the grid, plus the distance to it.
    """
    pose, grid, size, spline = solids
    q0, q1, q2 = p0 - pose[m, 9], p1 - pose[m, 10], p2 - pose[m, 11]
    index = np.empty(3, dtype=np.int64)
    w = np.empty((3, 4))
    d = np.empty((3, 4))
    c = np.empty((3, 4))
    beyond = 0.0
    spacing = grid[m, 3]
    for i in range(3):
        # B frame: Rᵀ q
        local = pose[m, i] * q0 + pose[m, 3 + i] * q1 + pose[m, 6 + i] * q2
        u = (local - grid[m, i]) / spacing
        low, high = 1.0, float(size[m, i]) - 3.0
        inside = min(max(u, low), high)
        beyond += (u - inside) ** 2
        index[i] = min(int(inside), size[m, i] - 3)
        _weights(inside - index[i], w[i], d[i], c[i])
    value = 0.0
    g0 = g1 = g2 = 0.0
    h00 = h01 = h02 = h11 = h12 = h22 = 0.0
    for i in range(4):
        for j in range(4):
            base = (
                size[m, 3]
                + ((index[0] - 1 + i) * size[m, 1] + index[1] - 1 + j) * size[m, 2]
                + index[2]
                - 1
            )
            v = v1 = v2 = 0.0
            for k in range(4):
                s = spline[base + k]
                v += s * w[2, k]
                v1 += s * d[2, k]
                v2 += s * c[2, k]
            value += w[0, i] * w[1, j] * v
            if order >= 1:
                g0 += d[0, i] * w[1, j] * v
                g1 += w[0, i] * d[1, j] * v
                g2 += w[0, i] * w[1, j] * v1
            if order >= 2:
                h00 += c[0, i] * w[1, j] * v
                h01 += d[0, i] * d[1, j] * v
                h02 += d[0, i] * w[1, j] * v1
                h11 += w[0, i] * c[1, j] * v
                h12 += w[0, i] * d[1, j] * v1
                h22 += w[0, i] * w[1, j] * v2
    if order >= 1:
        for i in range(3):
            gradient[i] = (
                pose[m, 3 * i] * g0 + pose[m, 3 * i + 1] * g1 + pose[m, 3 * i + 2] * g2
            ) / spacing
    if order >= 2:
        body = np.empty((3, 3))
        body[0, 0], body[1, 1], body[2, 2] = h00, h11, h22
        body[0, 1] = body[1, 0] = h01
        body[0, 2] = body[2, 0] = h02
        body[1, 2] = body[2, 1] = h12
        for i in range(3):
            for j in range(3):
                total = 0.0
                for k in range(3):
                    for n in range(3):
                        total += pose[m, 3 * i + k] * body[k, n] * pose[m, 3 * j + n]
                hessian[i, j] = total / (spacing * spacing)
    return value + spacing * np.sqrt(beyond)


@nb.njit(cache=True, nogil=True)
def nearest_obstacle(x: FloatArray, shapes: Any, distance: FloatArray, owner: IntArray) -> None:
    """Writes the least signed distance (k,), m, and its obstacle (k,) for points `x` (k,3).

    `owner` is -1 if there is no obstacle.
    """
    a, b, cone, point, normal, solids = shapes
    m, k = cone.shape[0], point.shape[0]
    # Neighbours mostly have the same nearest capsule, so it is tried first; others are tried only
    # if a ball around them comes as near.
    ball = np.empty((m if x.shape[0] > m else 0, 4))
    for j in range(ball.shape[0]):
        half2 = 0.0
        for c in range(3):
            ball[j, c] = 0.5 * (a[j, c] + b[j, c])
            half2 += 0.25 * (a[j, c] - b[j, c]) ** 2
        ball[j, 3] = np.sqrt(half2) + (cone[j, 0] + max(cone[j, 1], 0.0)) + _ROUNDING
    last = 0
    for i in range(x.shape[0]):
        p0, p1, p2 = x[i, 0], x[i, 1], x[i, 2]
        best = _FAR
        who = -1
        if ball.shape[0] > 0:
            d, _ = _round_cone(p0, p1, p2, a, b, cone, last)
            if d < best:
                best = d
                who = last
        for j in range(m):
            if ball.shape[0] > 0:
                far = best + ball[j, 3]
                way2 = (p0 - ball[j, 0]) ** 2 + (p1 - ball[j, 1]) ** 2 + (p2 - ball[j, 2]) ** 2
                if j == last or (far > 0.0 and way2 > far * far):
                    continue
            d, _ = _round_cone(p0, p1, p2, a, b, cone, j)
            if d < best or (d == best and j < who):
                best = d
                who = j
        last = max(who, 0)
        for j in range(k):
            d = (
                (p0 - point[j, 0]) * normal[j, 0]
                + (p1 - point[j, 1]) * normal[j, 1]
                + (p2 - point[j, 2]) * normal[j, 2]
            )
            if d < best:
                best = d
                who = m + j
        distance[i] = best
        owner[i] = who
    if solids[0].shape[0]:
        _nearest_solid(x, solids, m + k, distance, owner)


@nb.njit(cache=True, nogil=True)
def nearest_other(
    x: FloatArray, shapes: Any, owner: IntArray, distance: FloatArray, other: IntArray
) -> None:
    """Writes the nearest body other than `owner` (k,) and its distance, m, for points `x` (k,3)."""
    a, b, cone, point, normal, solids = shapes
    m, k = cone.shape[0], point.shape[0]
    gradient = np.empty(3)
    hessian = np.empty((3, 3))
    for i in range(x.shape[0]):
        p0, p1, p2 = x[i, 0], x[i, 1], x[i, 2]
        distance[i] = _FAR
        other[i] = -1
        for j in range(m + k + solids[0].shape[0]):
            if j == owner[i]:
                continue
            if j < m:
                d, _ = _round_cone(p0, p1, p2, a, b, cone, j)
            elif j < m + k:
                d = 0.0
                for c in range(3):
                    d += (x[i, c] - point[j - m, c]) * normal[j - m, c]
            else:
                d = _solid(p0, p1, p2, solids, j - m - k, gradient, hessian, 0)
            if d < distance[i]:
                distance[i] = d
                other[i] = j


@nb.njit(cache=True, nogil=True)
def _nearest_solid(x, solids, first, distance, owner):  # type: ignore[no-untyped-def]
    gradient = np.empty(3)
    hessian = np.empty((3, 3))
    for i in range(x.shape[0]):
        for j in range(solids[0].shape[0]):
            d = _solid(x[i, 0], x[i, 1], x[i, 2], solids, j, gradient, hessian, 0)
            if d < distance[i]:
                distance[i] = d
                owner[i] = first + j


@nb.njit(cache=True, nogil=True)
def distance_to(x: FloatArray, shapes: Any, owner: IntArray, distance: FloatArray) -> None:
    """Writes the signed distance (k,), m, of each point of `x` (k,3) to the body `owner` (k,)."""
    a, b, cone, point, normal, solids = shapes
    m, k = cone.shape[0], point.shape[0]
    gradient = np.empty(3)
    hessian = np.empty((3, 3))
    for i in range(x.shape[0]):
        who = owner[i]
        if who < m:
            distance[i], _ = _round_cone(x[i, 0], x[i, 1], x[i, 2], a, b, cone, who)
        elif who < m + k:
            distance[i] = 0.0
            for c in range(3):
                distance[i] += (x[i, c] - point[who - m, c]) * normal[who - m, c]
        else:
            distance[i] = _solid(
                x[i, 0], x[i, 1], x[i, 2], solids, who - m - k, gradient, hessian, 0
            )


@nb.njit(cache=True, nogil=True)
def may_touch(  # type: ignore[no-untyped-def]
    x, motion, shapes, margin, surface_motion, excluded
):
    """Returns which nodes may touch something within a step: nodes (c,), distances, owners.

    A distance changes by no more than its point moves. So nodes farther away than their own motion
    plus the largest motion of a surface are left out.
    """
    n = x.shape[0]
    all_distance = np.empty(n)
    all_owner = np.empty(n, dtype=np.int32)
    nearest_obstacle(x, shapes, all_distance, all_owner)
    nodes = np.empty(n, dtype=np.int32)
    distance = np.empty(n)
    owner = np.empty(n, dtype=np.int32)
    count = 0
    for i in range(n):
        if excluded[i] or all_owner[i] < 0:
            continue
        way = np.sqrt(motion[i, 0] ** 2 + motion[i, 1] ** 2 + motion[i, 2] ** 2)
        if all_distance[i] - margin < way + surface_motion:
            nodes[count] = i
            distance[count] = all_distance[i]
            owner[count] = all_owner[i]
            count += 1
    return nodes[:count], distance[:count], owner[:count]


@nb.njit(cache=True, nogil=True)
def first_touch(  # type: ignore[no-untyped-def]
    x, motion, shapes, margin, owner
):
    """Returns which points (k,) come within `margin` on a straight path; writes bodies to `owner`.

    A distance changes by no more than its point moves, so a point may advance by its distance at
    once (sphere tracing): nothing that is thicker than the tolerance is skipped.
    """
    touched = np.zeros(x.shape[0], dtype=np.bool_)
    point = np.empty((1, 3))
    distance = np.empty(1)
    who = np.empty(1, dtype=np.int32)
    for i in range(x.shape[0]):
        way = np.sqrt(motion[i, 0] ** 2 + motion[i, 1] ** 2 + motion[i, 2] ** 2)
        gone = 0.0
        for _ in range(MOST_MARCHES):
            share = gone / way if way > 0.0 else 0.0
            for c in range(3):
                point[0, c] = x[i, c] + share * motion[i, c]
            nearest_obstacle(point, shapes, distance, who)
            gap = distance[0] - margin
            if gap <= TOUCH:
                touched[i] = True
                owner[i] = who[0]
                break
            gone += gap
            if gone > way:
                break
    return touched


@nb.njit(cache=True, nogil=True)
def surface_frame(
    x: FloatArray,
    shapes: Any,
    origin: FloatArray,
    velocity: FloatArray,
    angular_velocity: FloatArray,
    owner: IntArray,
    normal: FloatArray,
    slope: FloatArray,
    surface_velocity: FloatArray,
) -> None:
    """Writes outward unit normals (n,3), slopes (n,) and velocities (n,3) at the points `x` (n,3).

    The gradient of the distance is slope · normal; the slope is 1 except for solids, whose
    distances are interpolated. The velocity is that of the rigid body at the point itself. Rows
    without owner have zero normal and velocity.
    """
    a, b, cone, point, plane, solids = shapes
    m, k = cone.shape[0], point.shape[0]
    gradient = np.empty(3)
    hessian = np.empty((3, 3))
    for i in range(x.shape[0]):
        who = owner[i]
        slope[i] = 1.0
        for c in range(3):
            normal[i, c] = 0.0
            surface_velocity[i, c] = 0.0
        if who < 0:
            continue
        q0, q1, q2 = x[i, 0] - origin[who, 0], x[i, 1] - origin[who, 1], x[i, 2] - origin[who, 2]
        w0, w1, w2 = angular_velocity[who, 0], angular_velocity[who, 1], angular_velocity[who, 2]
        surface_velocity[i, 0] = velocity[who, 0] + w1 * q2 - w2 * q1
        surface_velocity[i, 1] = velocity[who, 1] + w2 * q0 - w0 * q2
        surface_velocity[i, 2] = velocity[who, 2] + w0 * q1 - w1 * q0
        if who < m:
            _, t = _round_cone(x[i, 0], x[i, 1], x[i, 2], a, b, cone, who)
            size2 = 0.0
            for c in range(3):
                r = x[i, c] - a[who, c] - t * (b[who, c] - a[who, c])
                normal[i, c] = r
                size2 += r * r
            r = np.sqrt(size2)
            if r > 1e-12:
                for c in range(3):
                    normal[i, c] /= r
            else:
                normal[i, 0] = normal[i, 1] = 0.0
                normal[i, 2] = 1.0
        elif who < m + k:
            for c in range(3):
                normal[i, c] = plane[who - m, c]
        else:
            _solid(x[i, 0], x[i, 1], x[i, 2], solids, who - m - k, gradient, hessian, 1)
            r = np.sqrt(gradient[0] ** 2 + gradient[1] ** 2 + gradient[2] ** 2)
            if r > 1e-12:
                slope[i] = r
                for c in range(3):
                    normal[i, c] = gradient[c] / r
            else:
                normal[i, 2] = 1.0


@nb.njit(cache=True, nogil=True)
def normal_derivative(
    x: FloatArray,
    shapes: Any,
    owner: IntArray,
    normal: FloatArray,
    normal_bar: FloatArray,
    out: FloatArray,
) -> None:
    """Writes (k,3) the derivative of n̄·n with respect to the points `x` (k,3)."""
    a, b, cone, point, _, solids = shapes
    m, k = cone.shape[0], point.shape[0]
    gradient = np.empty(3)
    hessian = np.empty((3, 3))
    for i in range(x.shape[0]):
        who = owner[i]
        for c in range(3):
            out[i, c] = 0.0
        if who < 0 or m <= who < m + k:
            continue
        along = 0.0
        for c in range(3):
            along += normal_bar[i, c] * normal[i, c]
        if who < m:
            d, t = _round_cone(x[i, 0], x[i, 1], x[i, 2], a, b, cone, who)
            growth = cone[who, 1]
            inverse = 1.0 / max(d + (cone[who, 0] + t * growth), 1e-9)
            axial = 0.0
            length2 = 1e-30 - growth * growth
            for c in range(3):
                out[i, c] = (normal_bar[i, c] - along * normal[i, c]) * inverse
                # along the surface, which the axis of a capsule is parallel to
                e = b[who, c] - a[who, c]
                axial += out[i, c] * (e + growth * normal[i, c])
                length2 += e * e
            if 0.0 < t < 1.0:
                for c in range(3):
                    e = b[who, c] - a[who, c] + growth * normal[i, c]
                    out[i, c] -= axial / length2 * e
            continue
        _solid(x[i, 0], x[i, 1], x[i, 2], solids, who - m - k, gradient, hessian, 2)
        r = np.sqrt(gradient[0] ** 2 + gradient[1] ** 2 + gradient[2] ** 2)
        if r <= 1e-12:
            continue
        for c in range(3):
            total = 0.0
            for e in range(3):
                share = (normal_bar[i, e] - along * normal[i, e]) / r
                total += hessian[e, c] * share
            out[i, c] = total
