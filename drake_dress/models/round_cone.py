"""Round cones: two spheres of different radii and the cone that touches both.

A point of the axis at the share t of its length L is the centre of a sphere of radius
r(t) = r_a + t d, d = r_b - r_a. The round cone is the union of these spheres, so its signed
distance at p is

    φ(p) = min over t in [0, 1] of |p - c(t)| - r(t),   t* = clamp(foot + lean · ρ),

with the foot of p on the axis, its distance ρ from the axis, and lean = d / (L √(L² - d²)). With
equal radii lean is zero, and it is a capsule. If |d| ≥ L, one sphere holds the other, and the round
cone is that sphere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray

# Share of L² that L² - d² must exceed; otherwise the round cone counts as its larger sphere.
_ALMOST_HELD = 1e-9


def both_radii(radius: FloatArray) -> FloatArray:
    """Returns the radii (m,2) at both ends, m, from (m,2), or from (m,) with equal ends."""
    r = np.asarray(radius, dtype=np.float64)
    return np.stack([r, r], axis=1) if r.ndim == 1 else np.ascontiguousarray(r)


def packed_cones(
    a: FloatArray, b: FloatArray, radius: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns ends (m,3), (m,3) and, for kernels, (m,3): r_a, d, m, and lean, 1/m.

    A round cone that is one sphere has that sphere's centre as both ends.

    Args:
        a: (m,3) first ends of the axes, m.
        b: (m,3) second ends, m.
        radius: (m,2) radii at both ends, m.
    """
    cone = np.empty((len(radius), 3))
    if _find_leans(a, b, radius, cone):
        held = np.isnan(cone[:, 2])
        grows = (cone[:, 1] > 0.0)[:, None]
        end = np.where(grows, b, a)
        a, b = np.where(held[:, None], end, a), np.where(held[:, None], end, b)
        cone[held, 0], cone[held, 1:] = radius[held].max(axis=1), 0.0
    return a, b, cone


@nb.njit(cache=True, nogil=True)
def _find_leans(a, b, radius, cone):  # type: ignore[no-untyped-def]
    """Writes r_a, d and lean to `cone` (m,3), NaN for one sphere; returns whether there is one."""
    one_sphere = False
    for k in range(radius.shape[0]):
        growth = radius[k, 1] - radius[k, 0]
        cone[k, 0], cone[k, 1], cone[k, 2] = radius[k, 0], growth, 0.0
        if growth == 0.0:
            continue
        length2 = (b[k, 0] - a[k, 0]) ** 2 + (b[k, 1] - a[k, 1]) ** 2 + (b[k, 2] - a[k, 2]) ** 2
        cone[k, 2] = find_lean(length2, growth)
        one_sphere = one_sphere or np.isnan(cone[k, 2])
    return one_sphere


@nb.njit(cache=True, nogil=True)
def find_lean(length2, growth):  # type: ignore[no-untyped-def]
    """Returns lean, 1/m, for a squared length, m², and a growth of the radius, m; NaN if held."""
    free = length2 - growth * growth
    if free <= _ALMOST_HELD * length2:
        return np.nan
    return growth / np.sqrt(length2 * free)


@nb.njit(cache=True, nogil=True)
def nearest_share(p, a, b, growth):  # type: ignore[no-untyped-def]
    """Returns t* of a point `p` (3,): the share of the axis a–b whose sphere is nearest.

    Args:
        p: (3,) point, m.
        a: (3,) first end of the axis, m.
        b: (3,) second end, m.
        growth: radius at b less radius at a, m.
    """
    length2, along = 0.0, 0.0
    for k in range(3):
        length2 += (b[k] - a[k]) ** 2
        along += (p[k] - a[k]) * (b[k] - a[k])
    lean = find_lean(length2, growth)
    if np.isnan(lean):
        return 1.0 if growth > 0.0 else 0.0
    t, from_axis2 = along / length2, 0.0
    for k in range(3):
        from_axis2 += (p[k] - a[k] - t * (b[k] - a[k])) ** 2
    return min(1.0, max(0.0, t + lean * np.sqrt(from_axis2)))


def surface(
    length: float, radii: tuple[float, float], rings: int = 10, sectors: int = 32
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Returns vertices (v,3), m, outward unit normals (v,3) and triangles (f,3) of a round cone.

    Its axis is along z, end a at z = -length/2. All vertices are on the surface.

    Args:
        length: length of its axis, m.
        radii: radii at both ends, m; they differ by less than the length.
        rings: number of rings between a pole and the circle in which its sphere touches the cone.
        sectors: number of vertices around the axis.
    """
    touching = np.arccos((radii[0] - radii[1]) / length)
    polar = np.concatenate(
        [np.linspace(np.pi, touching, rings + 1), np.linspace(touching, 0.0, rings + 1)]
    )
    angle = 2.0 * np.pi * np.arange(sectors) / sectors
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    normal = np.empty((len(polar), sectors, 3))
    normal[..., :2] = np.sin(polar)[:, None, None] * around
    normal[..., 2] = np.cos(polar)[:, None]
    of_a = np.arange(len(polar))[:, None, None] <= rings
    vertex = np.where(of_a, radii[0], radii[1]) * normal
    vertex[..., 2] += np.where(of_a[..., 0], -0.5, 0.5) * length
    first = np.arange(sectors)
    then = (first + 1) % sectors
    row = sectors * np.arange(len(polar) - 1)[:, None]
    lower = np.stack([row + first, row + then, row + sectors + then], axis=-1)
    upper = np.stack([row + first, row + sectors + then, row + sectors + first], axis=-1)
    faces = np.concatenate([lower, upper]).reshape(-1, 3).astype(np.int32)
    return vertex.reshape(-1, 3), normal.reshape(-1, 3), faces


@dataclass(frozen=True)
class SolidCone:
    """A round cone of uniform density.

    Attributes:
        volume: m³.
        center: distance of the centre of mass from end a along the axis, m.
        about_axis: moment of inertia about the axis per mass, m².
        across: moment of inertia about any normal to it through the centre of mass, per mass, m².
    """

    volume: float
    center: float
    about_axis: float
    across: float


def solid(length: float, radii: tuple[float, float]) -> SolidCone:
    """Returns the mass properties of a round cone with a length and radii at both ends, m.

    It is a body of revolution of two caps and a frustum, in which the squared radius R² at the
    height z is a polynomial. So Gauss-Legendre quadrature is exact.
    """
    if abs(radii[0] - radii[1]) >= length:
        r, about = max(radii), 0.4 * max(radii) ** 2
        return SolidCone(4.0 / 3.0 * np.pi * r**3, length * (radii[1] > radii[0]), about, about)
    cosine = (radii[0] - radii[1]) / length
    sine = np.sqrt(1.0 - cosine * cosine)
    low, high = cosine * radii[0], length + cosine * radii[1]
    node, weight = np.polynomial.legendre.leggauss(3)
    moments = np.zeros(4)  # integrals of R², R² z, R² z², R⁴
    for first, last in ((-radii[0], low), (low, high), (high, length + radii[1])):
        z = 0.5 * (first + last) + 0.5 * (last - first) * node
        if first == low:
            share = (z - low) / (high - low)
            r2 = (sine * (radii[0] + share * (radii[1] - radii[0]))) ** 2
        else:
            own, middle = (radii[0], 0.0) if first < low else (radii[1], length)
            r2 = own**2 - (z - middle) ** 2
        w = 0.5 * (last - first) * weight
        moments += [w @ r2, w @ (r2 * z), w @ (r2 * z * z), w @ (r2 * r2)]
    volume = np.pi * moments[0]
    center = moments[1] / moments[0]
    about_axis = 0.5 * moments[3] / moments[0]
    across = 0.5 * about_axis + moments[2] / moments[0] - center**2
    return SolidCone(float(volume), float(center), float(about_axis), float(across))
