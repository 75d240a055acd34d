"""What the garment touches: moving capsules and spheres."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.cloth.elements import FloatArray, IntArray


@dataclass(frozen=True)
class Obstacles:
    """Capsules in the world frame; a sphere is a capsule with a == b.

    Attributes:
        a, b: (m,3) ends of the axis, m.
        radius: (m,), m.
        velocity: (m,3) of point a, m/s.
        angular_velocity: (m,3), rad/s.
    """

    a: FloatArray
    b: FloatArray
    radius: FloatArray
    velocity: FloatArray
    angular_velocity: FloatArray

    @staticmethod
    def none() -> Obstacles:
        """Returns no obstacle at all."""
        return Obstacles(*(np.zeros(s) for s in ((0, 3), (0, 3), (0,), (0, 3), (0, 3))))

    @staticmethod
    def resting(a: FloatArray, b: FloatArray, radius: FloatArray) -> Obstacles:
        """Returns capsules that do not move."""
        zero = np.zeros_like(np.asarray(a, dtype=np.float64))
        return Obstacles(
            np.ascontiguousarray(a, dtype=np.float64),
            np.ascontiguousarray(b, dtype=np.float64),
            np.ascontiguousarray(radius, dtype=np.float64),
            zero,
            zero.copy(),
        )

    def advanced(self, duration: float) -> Obstacles:
        """Returns the capsules `duration` seconds later, at constant rigid velocity."""
        axis = self.b - self.a
        angle = np.linalg.norm(self.angular_velocity, axis=1) * duration
        unit = (
            self.angular_velocity
            / np.maximum(np.linalg.norm(self.angular_velocity, axis=1), 1e-12)[:, None]
        )
        sine, cosine = np.sin(angle)[:, None], np.cos(angle)[:, None]
        along = np.einsum("ij,ij->i", unit, axis)[:, None]
        turned = axis * cosine + np.cross(unit, axis) * sine + unit * along * (1.0 - cosine)
        a = self.a + duration * self.velocity
        return Obstacles(a, a + turned, self.radius, self.velocity, self.angular_velocity)


@nb.njit(cache=True, nogil=True)
def _distance(p0, p1, p2, a, b, radius, m):  # type: ignore[no-untyped-def]
    """Returns signed distance and segment parameter of a point to capsule m."""
    d0, d1, d2 = b[m, 0] - a[m, 0], b[m, 1] - a[m, 1], b[m, 2] - a[m, 2]
    q0, q1, q2 = p0 - a[m, 0], p1 - a[m, 1], p2 - a[m, 2]
    length2 = d0 * d0 + d1 * d1 + d2 * d2
    t = 0.0
    if length2 > 0.0:
        t = min(1.0, max(0.0, (q0 * d0 + q1 * d1 + q2 * d2) / length2))
    r0, r1, r2 = q0 - t * d0, q1 - t * d1, q2 - t * d2
    return np.sqrt(r0 * r0 + r1 * r1 + r2 * r2) - radius[m], t


@nb.njit(cache=True, nogil=True)
def nearest_obstacle(
    x: FloatArray,
    a: FloatArray,
    b: FloatArray,
    radius: FloatArray,
    distance: FloatArray,
    owner: IntArray,
) -> None:
    """Writes for each point of `x` (k,3) the least signed distance (k,), m, and whose it is (k,).

    `owner` is -1 where there is no obstacle.
    """
    for i in range(x.shape[0]):
        best = 1e9
        who = -1
        for m in range(radius.shape[0]):
            d, _ = _distance(x[i, 0], x[i, 1], x[i, 2], a, b, radius, m)
            if d < best:
                best = d
                who = m
        distance[i] = best
        owner[i] = who


@nb.njit(cache=True, nogil=True)
def surface_frame(
    x: FloatArray,
    a: FloatArray,
    b: FloatArray,
    velocity: FloatArray,
    angular_velocity: FloatArray,
    owner: IntArray,
    normal: FloatArray,
    surface_velocity: FloatArray,
) -> None:
    """Writes outward normals and velocities of the obstacle `owner` (n,) at the points `x` (n,3).

    The velocity is that of the rigid body at the point itself. Rows without owner are zero.
    """
    for i in range(x.shape[0]):
        m = owner[i]
        for c in range(3):
            normal[i, c] = 0.0
            surface_velocity[i, c] = 0.0
        if m < 0:
            continue
        d0, d1, d2 = b[m, 0] - a[m, 0], b[m, 1] - a[m, 1], b[m, 2] - a[m, 2]
        q0, q1, q2 = x[i, 0] - a[m, 0], x[i, 1] - a[m, 1], x[i, 2] - a[m, 2]
        length2 = d0 * d0 + d1 * d1 + d2 * d2
        t = 0.0
        if length2 > 0.0:
            t = min(1.0, max(0.0, (q0 * d0 + q1 * d1 + q2 * d2) / length2))
        r0, r1, r2 = q0 - t * d0, q1 - t * d1, q2 - t * d2
        r = np.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
        if r > 1e-12:
            normal[i, 0] = r0 / r
            normal[i, 1] = r1 / r
            normal[i, 2] = r2 / r
        else:
            normal[i, 2] = 1.0
        w0, w1, w2 = angular_velocity[m, 0], angular_velocity[m, 1], angular_velocity[m, 2]
        surface_velocity[i, 0] = velocity[m, 0] + w1 * q2 - w2 * q1
        surface_velocity[i, 1] = velocity[m, 1] + w2 * q0 - w0 * q2
        surface_velocity[i, 2] = velocity[m, 2] + w0 * q1 - w1 * q0
