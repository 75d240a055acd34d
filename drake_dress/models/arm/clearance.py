"""Distances between round cones, and their rates as arms move.

The distance of two round cones is the least over both axes, with shares s and t,

    f(s, t) = |x(s) - y(t)| - r_x(s) - r_y(t),

which is convex. So the least is where the slopes vanish, if that is on both axes, else at the end
of one. An arm's own shapes are capsules.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.round_cone import both_radii, nearest_share
from drake_dress.models.vector3 import dot, length


@dataclass(frozen=True)
class Capsules:
    """K capsules or round cones.

    Attributes:
        first, second: (K,3) ends of their axes, m.
        radius: (K,) m, or (K,2) at both ends.
    """

    first: FloatArray
    second: FloatArray
    radius: FloatArray


@dataclass(frozen=True)
class ArmShape:
    """K capsules that enclose an arm, each fixed to one of its links.

    Attributes:
        link: (K,) link of each capsule: 0 the base, J the last link.
        capsules: in the frames of their links.
    """

    link: IndexArray
    capsules: Capsules

    def placed(self, links: FloatArray) -> Capsules:
        """Returns the capsules in W, at `links` (J+2,4,4) of `SerialArm.links`."""
        c = self.capsules
        placed = np.empty((2, len(self.link), 3))
        place_capsules(links, self.link, c.first, c.second, placed)
        return Capsules(placed[0], placed[1], c.radius)


@dataclass(frozen=True)
class Clearance:
    """The distances of M pairs of capsules.

    Attributes:
        pair: (M,2) indices.
        distance: (M,) m; negative where they overlap.
        here, there: (M,3) nearest points on the axes of both, m.
        away: (M,3) unit vector from there to here; along it the distance grows.
    """

    pair: IndexArray
    distance: FloatArray
    here: FloatArray
    there: FloatArray
    away: FloatArray


def clearance(a: Capsules, b: Capsules, pairs: IndexArray) -> Clearance:
    """Returns the distances between capsules of `a` and of `b`, for `pairs` (M,2) of indices."""
    here, there, away = (np.empty((len(pairs), 3)) for _ in range(3))
    distance = np.empty(len(pairs))
    radii, other_radii = both_radii(a.radius), both_radii(b.radius)
    _find_clearance(
        a.first, a.second, radii, b.first, b.second, other_radii, pairs, distance, here, there, away
    )
    return Clearance(pairs, distance, here, there, away)


@nb.njit(cache=True, nogil=True)
def _find_clearance(  # type: ignore[no-untyped-def]
    a, b, radius, c, d, other, pairs, distance, here, there, away
):
    for m in range(pairs.shape[0]):
        i, j = pairs[m, 0], pairs[m, 1]
        distance[m] = find_gap(
            a[i], b[i], radius[i], c[j], d[j], other[j], here[m], there[m], away[m]
        )


@nb.njit(cache=True, nogil=True)
def find_gap(a, b, radius, c, d, other, here, there, away):  # type: ignore[no-untyped-def]
    """Returns the distance of round cones about a–b and c–d, m, and writes their nearest points.

    Args:
        a: (3,) one end, m.
        b: (3,) the other.
        radius: (2,) radii at both, m.
        c: (3,) one end of the other axis, m.
        d: (3,) the other.
        other: (2,) radii at both, m.
        here: (3,) written: the nearest point of the first axis, m.
        there: (3,) written: the nearest point of the other.
        away: (3,) written: unit vector from there to here.
    """
    growth, growing = radius[1] - radius[0], other[1] - other[0]
    if growth == 0.0 and growing == 0.0:
        s, t = nearest(a, b, c, d)
    else:
        s, t = _nearest_of_cones(a, b, growth, c, d, growing)
    for k in range(3):
        here[k] = a[k] + s * (b[k] - a[k])
        there[k] = c[k] + t * (d[k] - c[k])
        away[k] = here[k] - there[k]
    apart = size = length(away)
    if apart <= 1e-9:
        # crossing axes have no separating direction; any normal to both will do
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            away[k] = (b[i] - a[i]) * (d[j] - c[j]) - (b[j] - a[j]) * (d[i] - c[i])
        size = length(away)
        if size <= 1e-12:
            away[0], away[1], away[2], size = 0.0, 0.0, 1.0, 1.0
    for k in range(3):
        away[k] /= size
    return apart - ((radius[0] + s * growth) + (other[0] + t * growing))


@nb.njit(cache=True, nogil=True)
def _nearest_of_cones(a, b, growth, c, d, growing):  # type: ignore[no-untyped-def]
    """Returns the shares s, t of both axes with the least f; see the module."""
    u, w, r = b - a, d - c, a - c
    uu, ww, uw, ur, wr = dot(u, u), dot(w, w), dot(u, w), dot(u, r), dot(w, r)
    det = uu * ww - uw * uw
    if det > 1e-12 * uu * ww:
        # slopes vanish where the unit vector n from there to here has n·u = growth, n·w = -growing
        in_plane = (ww * growth**2 + 2.0 * uw * growth * growing + uu * growing**2) / det
        if in_plane < 1.0:
            across = u[0] * (w[1] * r[2] - w[2] * r[1])
            across += u[1] * (w[2] * r[0] - w[0] * r[2])
            across += u[2] * (w[0] * r[1] - w[1] * r[0])
            size = np.abs(across) / np.sqrt(det * (1.0 - in_plane))
            along, other = size * growth - ur, -size * growing - wr
            s = (ww * along - uw * other) / det
            t = (uw * along - uu * other) / det
            if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
                return s, t
    least, best_s, best_t = np.inf, 0.0, 0.0
    for end in range(2):
        x = b if end == 1 else a
        t = nearest_share(x, c, d, growing)
        value = length(x - c - t * w) - end * growth - t * growing
        if value < least:
            least, best_s, best_t = value, float(end), t
        y = d if end == 1 else c
        s = nearest_share(y, a, b, growth)
        value = length(y - a - s * u) - s * growth - end * growing
        if value < least:
            least, best_s, best_t = value, s, float(end)
    return best_s, best_t


@nb.njit(cache=True, nogil=True)
def nearest(a, b, c, d):  # type: ignore[no-untyped-def]
    """Returns the nearest points of segments a–b and c–d, ends (3,): s, t from 0 to 1 along both.

    Source: Ericson, "Real-Time Collision Detection", 2005, 5.1.9. For parallel segments, which have
    many nearest pairs, it returns one.
    """
    uu, ww, uw, ur, wr = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        u, w, r = b[k] - a[k], d[k] - c[k], a[k] - c[k]
        uu += u * u
        ww += w * w
        uw += u * w
        ur += u * r
        wr += w * r
    s, t = 0.0, 0.0
    det = uu * ww - uw * uw
    if det > 1e-12 * uu * ww:
        s = min(1.0, max(0.0, (uw * wr - ww * ur) / det))
    if ww > 1e-18:
        t = min(1.0, max(0.0, (uw * s + wr) / ww))
    if uu > 1e-18:
        s = min(1.0, max(0.0, (uw * t - ur) / uu))
    return s, t


@nb.njit(cache=True, nogil=True)
def find_gap_rates(links, point, owner, away, sign, rates):  # type: ignore[no-untyped-def]
    """Writes ∂(rate of a distance)/∂(joint rates) for the arm at one end of the distance.

    Args:
        links: (J+2,4,4) of `SerialArm.links`.
        point: (3,) point of the arm that is nearest to the other capsule, m.
        owner: link that the point is fixed to.
        away: (3,) unit vector; the distance grows as the point moves along `sign` times it.
        sign: 1.0 or -1.0.
        rates: (J,) written.
    """
    for j in range(len(rates)):
        rates[j] = 0.0
        if j + 1 > owner:
            continue
        link = links[j + 1]
        x, y, z = point[0] - link[0, 3], point[1] - link[1, 3], point[2] - link[2, 3]
        rates[j] = sign * (
            away[0] * (link[1, 2] * z - link[2, 2] * y)
            + away[1] * (link[2, 2] * x - link[0, 2] * z)
            + away[2] * (link[0, 2] * y - link[1, 2] * x)
        )


@nb.njit(cache=True, nogil=True)
def place_capsules(links, owner, first, second, placed):  # type: ignore[no-untyped-def]
    """Writes the capsules' ends in W, given in the frames of their links, to `placed` (2,K,3)."""
    for k in range(len(owner)):
        x = links[owner[k]]
        for a in range(3):
            placed[0, k, a] = x[a, 3]
            placed[1, k, a] = x[a, 3]
            for b in range(3):
                placed[0, k, a] += x[a, b] * first[k, b]
                placed[1, k, a] += x[a, b] * second[k, b]
