"""Dressing coordinates of a point: progress along an arm, distance to it, and angle about it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from drake_dress.models.arrays import FloatArray

# Share of the shorter limb that the arc at the elbow takes when no radius is given.
_FILLET_SHARE = 0.3
# Greatest share of the shorter limb that an arc of a given radius may take; a straight part stays.
_NEAR_ELBOW = 0.4  # distance in s from the elbow at which `outward` ends
_MOST_SHARE = 0.9
# Bend, rad, below which the arm counts as straight: the arc is a line and its plane is undefined.
# Also the least angle of an arm from fully folded.
_STRAIGHT = 1e-6
_SHORTEST_LIMB = 1e-6


class DressingCoordinates(NamedTuple):
    """Cylindrical coordinates of a point about an arm.

    Attributes:
        s: progress of the nearest point of the axis: 0 hand, 1 elbow, 2 shoulder; in [0, 2].
        l: distance to the axis, m.
        theta: angle about the axis' direction, rad, in (−π, π].
    """

    s: float
    l: float
    theta: float


class ArmAxis:
    """The curve hand – elbow – shoulder with an arc at the elbow, as the axis of the coordinates.

    s = 0 at the hand, 1 in the middle of the arc, 2 at the shoulder; on either side of the elbow s
    grows with arc length. `G(s)` and `D(s)` are the paper's symbols: position (Eq. Jdi), and
    direction of the arm from hand to shoulder. As in the paper, the arc is tangent to both limbs,
    so that D does not jump at the elbow; the paper does not give its radius.

    Args:
        hand, elbow, shoulder: (3,), m, world or any frame; results are in the same frame.
        fillet_radius: radius of the arc, m, reduced so that the arc takes at most 0.9 of the
            shorter limb. None: the arc takes 0.3 of the shorter limb, whatever the bend.

    Raises:
        ValueError: two joints coincide, the forearm lies folded back on the upper arm, a value is
            not finite, or the radius is not positive.

    Source: paper, section Problem Formulation.
    """

    def __init__(
        self,
        hand: FloatArray,
        elbow: FloatArray,
        shoulder: FloatArray,
        fillet_radius: float | None = None,
    ) -> None:
        self._hand, self._elbow, self._shoulder = (
            np.array(p, dtype=np.float64) for p in (hand, elbow, shoulder)
        )
        lower, upper = self._elbow - self._hand, self._shoulder - self._elbow
        lower_length, upper_length = _length(lower), _length(upper)
        if not math.isfinite(lower_length + upper_length):
            raise ValueError("a joint of the arm is not finite")
        shorter = min(lower_length, upper_length)
        if shorter < _SHORTEST_LIMB:
            raise ValueError("two joints of the arm coincide")
        if fillet_radius is not None and not (np.isfinite(fillet_radius) and fillet_radius > 0.0):
            raise ValueError(f"fillet_radius is {fillet_radius}, expected a positive number of m")

        u, w = lower / lower_length, upper / upper_length
        cross = _cross(u, w)
        angle = math.atan2(_length(cross), u @ w)
        if angle > np.pi - _STRAIGHT:
            raise ValueError("the forearm lies folded back on the upper arm")
        straight = angle < _STRAIGHT
        half_tangent = math.tan(0.5 * angle)
        cut = _FILLET_SHARE * shorter
        if fillet_radius is not None and not straight:
            cut = min(fillet_radius * half_tangent, _MOST_SHARE * shorter)
        self._u, self._w, self._angle, self._straight = u, w, angle, straight
        self._start, self._end = self._elbow - cut * u, self._elbow + cut * w
        self._lower, self._upper = lower_length - cut, upper_length - cut
        if straight:
            self._normal = _perpendicular(u)
            self._inward, self._radius, self._half_arc = np.zeros(3), np.inf, cut
        else:
            self._normal = cross / _length(cross)
            self._inward = _cross(self._normal, u)
            self._radius = cut / half_tangent
            self._half_arc = 0.5 * angle * self._radius

    def G(self, s: float) -> FloatArray:
        """Returns the point (3,) of the axis at `s`, limited to [0, 2], m."""
        before, after = self._arc_length(s)
        if before <= self._lower:
            return self._hand + before * self._u
        if after <= self._upper:
            return self._shoulder - after * self._w
        distance = before - self._lower
        if self._straight:
            return self._start + distance * self._u
        phi = distance / self._radius
        point: FloatArray = self._start + self._radius * (
            np.sin(phi) * self._u + (1.0 - np.cos(phi)) * self._inward
        )
        return point

    def points(self, s: FloatArray) -> FloatArray:
        """Returns the points (k,3) of the axis at `s` (k,), each as from `G`, m."""
        s = np.clip(s, 0.0, 2.0)[:, None]
        lower, upper = self._lower + self._half_arc, self._upper + self._half_arc
        before = np.where(s <= 1.0, s * lower, lower + (s - 1.0) * upper)
        after = np.where(s <= 1.0, (1.0 - s) * lower + upper, (2.0 - s) * upper)
        distance = before - self._lower
        if self._straight:
            arc = self._start + distance * self._u
        else:
            phi = distance / self._radius
            arc = self._start + self._radius * (
                np.sin(phi) * self._u + (1.0 - np.cos(phi)) * self._inward
            )
        on_upper = np.where(after <= self._upper, self._shoulder - after * self._w, arc)
        return np.where(before <= self._lower, self._hand + before * self._u, on_upper)

    def D(self, s: float) -> FloatArray:
        """Returns the unit direction (3,) hand → shoulder at `s`, limited to [0, 2].

        It is the direction of dG/ds, and continuous.
        """
        before, after = self._arc_length(s)
        if before <= self._lower or self._straight:
            return self._u.copy()
        if after <= self._upper:
            return self._w.copy()
        phi = (before - self._lower) / self._radius
        direction: FloatArray = np.cos(phi) * self._u + np.sin(phi) * self._inward
        return direction

    def outward(self, s: float) -> FloatArray:
        """Returns the direction (3,) away from the inside of the elbow's bend near the elbow.

        Its length is the sine of half the bend at s = 1 and falls to zero at `_NEAR_ELBOW` from it.
        """
        off = min(1.0, abs(float(s) - 1.0) / _NEAR_ELBOW)
        if self._straight or off >= 1.0:
            return np.zeros(3)
        way = self._u - self._w
        size = 0.5 * (1.0 + math.cos(math.pi * off)) * math.sin(0.5 * self._angle)
        outward: FloatArray = size / _length(way) * way
        return outward

    def to_shoulder(self, s: float) -> float:
        """Returns the length of axis from `s`, limited to [0, 2], to the shoulder, m."""
        return self._arc_length(s)[1]

    def coordinates(self, point: FloatArray) -> DressingCoordinates:
        """Returns (s, l, theta) of a point (3,): progress, distance to the axis, m, angle, rad.

        theta is measured about D(s), from (p_e − p_h) × (p_s − p_e). For a straight arm, where that
        is zero, it is measured from a normal fixed by the arm's own direction. It then tells points
        apart, but is not comparable between arms.

        s does not show whether the arm is covered. The paper's s = 0 for a sleeve that is not on is
        up to the caller, who knows the linking number. `beyond_hand` tells how far off it is.
        """
        s, foot = self._nearest(np.asarray(point, dtype=np.float64))
        offset = point - foot
        direction = self.D(s)
        theta = float(np.arctan2(offset @ _cross(direction, self._normal), offset @ self._normal))
        return DressingCoordinates(s, _length(offset), theta)

    def beyond_hand(self, point: FloatArray) -> float:
        """Returns how far a point (3,) lies past the hand, measured along the forearm, m.

        Positive beyond the hand, where the sleeve cannot cover the arm and s stays 0; negative on
        the elbow's side of the plane through the hand.
        """
        return float((self._hand - point) @ self._u)

    def _arc_length(self, s: float) -> tuple[float, float]:
        """Returns the length of axis before and after `s`, m."""
        s = min(2.0, max(0.0, float(s)))
        lower, upper = self._lower + self._half_arc, self._upper + self._half_arc
        if s <= 1.0:
            return s * lower, (1.0 - s) * lower + upper
        return lower + (s - 1.0) * upper, (2.0 - s) * upper

    def _nearest(self, point: FloatArray) -> tuple[float, FloatArray]:
        """Returns progress and position of the nearest point of forearm, arc and upper arm."""
        lower, upper = self._lower + self._half_arc, self._upper + self._half_arc
        before = float(np.clip((point - self._hand) @ self._u, 0.0, self._lower))
        after = float(np.clip((self._shoulder - point) @ self._w, 0.0, self._upper))
        candidates = [
            (before / lower, self._hand + before * self._u),
            (2.0 - after / upper, self._shoulder - after * self._w),
        ]
        if self._straight:
            distance = float(np.clip((point - self._start) @ self._u, 0.0, 2.0 * self._half_arc))
            arc_foot = self._start + distance * self._u
        else:
            to_point = point - (self._start + self._radius * self._inward)
            phi = float(np.arctan2(to_point @ self._u, -(to_point @ self._inward)))
            # beyond the arc its end is nearest, and the limb there is nearer still
            phi = min(max(phi, 0.0), self._angle)
            distance = self._radius * phi
            arc_foot = self._start + self._radius * (
                np.sin(phi) * self._u + (1.0 - np.cos(phi)) * self._inward
            )
        along = self._lower + distance
        s_arc = along / lower if along <= lower else 1.0 + (along - lower) / upper
        candidates.append((s_arc, arc_foot))
        gaps = [float(np.sum((point - foot) ** 2)) for _, foot in candidates]
        return candidates[int(np.argmin(gaps))]


def _length(v: FloatArray) -> float:
    return math.sqrt(v @ v)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Returns a × b of two (3,); `np.cross` takes ten times as long for one pair."""
    a0, a1, a2 = a.tolist()
    b0, b1, b2 = b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def _perpendicular(direction: FloatArray) -> FloatArray:
    normal = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    unit: FloatArray = normal / np.linalg.norm(normal)
    return unit
