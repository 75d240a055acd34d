"""How far capsules are apart, and how that changes as arms move."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
import numpy.typing as npt

from drake_dress.models.arm.chain import SerialArm

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Capsules:
    """K capsules.

    Attributes:
        first, second: (K,3) ends of their axes, m.
        radius: (K,) m.
    """

    first: FloatArray
    second: FloatArray
    radius: FloatArray


@dataclass(frozen=True)
class ArmShape:
    """K capsules that hold an arm, each fixed to one of its links.

    Attributes:
        link: (K,) 0 the base, J the last link.
        capsules: in the frames of their links.
    """

    link: IntArray
    capsules: Capsules

    def placed(self, links: FloatArray) -> Capsules:
        """Returns the capsules in W, at `links` (J+2,4,4) of `SerialArm.links`."""
        x = links[self.link]
        r, p = x[:, :3, :3], x[:, :3, 3]
        c = self.capsules
        return Capsules(
            np.einsum("kab,kb->ka", r, c.first) + p,
            np.einsum("kab,kb->ka", r, c.second) + p,
            c.radius,
        )


@dataclass(frozen=True)
class Clearance:
    """The distances of M pairs of capsules.

    Attributes:
        pair: (M,2) indices.
        distance: (M,) m; negative where they overlap.
        here, there: (M,3) on the axes of both, m.
        away: (M,3) unit vector from there to here; along it the distance grows.
    """

    pair: IntArray
    distance: FloatArray
    here: FloatArray
    there: FloatArray
    away: FloatArray


def clearance(a: Capsules, b: Capsules, pairs: IntArray) -> Clearance:
    """Returns how far capsules of `a` are from those of `b`, for `pairs` (M,2) of both."""
    here, there, away = (np.empty((len(pairs), 3)) for _ in range(3))
    distance = np.empty(len(pairs))
    _find_clearance(
        a.first, a.second, a.radius, b.first, b.second, b.radius, pairs, distance, here, there, away
    )
    return Clearance(pairs, distance, here, there, away)


@nb.njit(cache=True, nogil=True)
def _find_clearance(  # type: ignore[no-untyped-def]
    a, b, radius, c, d, other_radius, pairs, distance, here, there, away
):
    for m in range(pairs.shape[0]):
        i, j = pairs[m, 0], pairs[m, 1]
        s, t = nearest(a[i], b[i], c[j], d[j])
        length2 = 0.0
        for k in range(3):
            here[m, k] = a[i, k] + s * (b[i, k] - a[i, k])
            there[m, k] = c[j, k] + t * (d[j, k] - c[j, k])
            away[m, k] = here[m, k] - there[m, k]
            length2 += away[m, k] * away[m, k]
        length = np.sqrt(length2)
        distance[m] = length - radius[i] - other_radius[j]
        if length > 1e-9:
            away[m] /= length
            continue
        # axes that cross have no direction apart; any across both will do
        u, w = b[i] - a[i], d[j] - c[j]
        away[m, 0] = u[1] * w[2] - u[2] * w[1]
        away[m, 1] = u[2] * w[0] - u[0] * w[2]
        away[m, 2] = u[0] * w[1] - u[1] * w[0]
        size = np.sqrt(away[m, 0] ** 2 + away[m, 1] ** 2 + away[m, 2] ** 2)
        if size > 1e-12:
            away[m] /= size
        else:
            away[m, 0], away[m, 1], away[m, 2] = 0.0, 0.0, 1.0


@nb.njit(cache=True, nogil=True)
def nearest(a, b, c, d):  # type: ignore[no-untyped-def]
    """Returns where segments a–b and c–d, ends (3,), are nearest: s, t from 0 to 1 along both.

    Source: Ericson, "Real-Time Collision Detection", 2005, 5.1.9. Of parallel segments, which have
    many nearest pairs, one.
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


def clearance_rates(
    near: Clearance, arm: SerialArm, shape: ArmShape, links: FloatArray, side: int
) -> FloatArray:
    """Returns (M,J) ∂(rate of distance)/∂(joint rates) of the arm at one side of the pairs.

    Args:
        near: pairs of its capsules with others.
        arm: whose.
        shape: its capsules.
        links: (J+2,4,4) where they are.
        side: 0 if it is the first of each pair, 1 if the second.
    """
    points = near.here if side == 0 else near.there
    sign = 1.0 if side == 0 else -1.0
    rates = np.empty((len(points), arm.count))
    _find_rates(links, points, shape.link[near.pair[:, side]], sign * near.away, rates)
    return rates


@nb.njit(cache=True, nogil=True)
def _find_rates(links, points, owner, away, rates):  # type: ignore[no-untyped-def]
    for m in range(points.shape[0]):
        for j in range(rates.shape[1]):
            rates[m, j] = 0.0
            if j + 1 > owner[m]:
                continue
            link = links[j + 1]
            x, y, z = (
                points[m, 0] - link[0, 3],
                points[m, 1] - link[1, 3],
                points[m, 2] - link[2, 3],
            )
            rates[m, j] = (
                away[m, 0] * (link[1, 2] * z - link[2, 2] * y)
                + away[m, 1] * (link[2, 2] * x - link[0, 2] * z)
                + away[m, 2] * (link[0, 2] * y - link[1, 2] * x)
            )
