"""Dressing coordinates: how far along, how far beside and on which side of an arm a point is."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

# Share of the shorter limb that the arc at the elbow may take.
_FILLET_SHARE = 0.3
_SAMPLES = 129


class ArmAxis:
    """The curve hand – elbow – shoulder with an arc at the elbow, as a cylinder's axis.

    s = 0 at the hand, 1 in the middle of the arc, 2 at the shoulder; between, s grows with arc
    length. `G(s)` and `D(s)` are the paper's symbols: position (Eq. Jdi), and direction of the
    arm from hand to shoulder.

    Args:
        hand, elbow, shoulder: (3,), m, world.

    Raises:
        ValueError: two joints coincide.
    """

    def __init__(self, hand: FloatArray, elbow: FloatArray, shoulder: FloatArray) -> None:
        lower, upper = elbow - hand, shoulder - elbow
        lower_length, upper_length = np.linalg.norm(lower), np.linalg.norm(upper)
        if lower_length < 1e-6 or upper_length < 1e-6:
            raise ValueError("two joints of the arm coincide")
        u, w = lower / lower_length, upper / upper_length
        self._elbow = np.asarray(elbow, dtype=np.float64)
        self._reference = np.cross(lower, upper)
        cut = _FILLET_SHARE * min(lower_length, upper_length)
        start, end = elbow - cut * u, elbow + cut * w
        angle = float(np.arccos(np.clip(u @ w, -1.0, 1.0)))
        # A circular arc tangent to both limbs, sampled; a straight arm needs none.
        t = np.linspace(0.0, 1.0, _SAMPLES)
        if angle < 1e-6:
            arc = start + t[:, None] * (end - start)
        else:
            radius = cut / np.tan(0.5 * angle)
            inward = w - (w @ u) * u
            inward = inward / np.linalg.norm(inward)
            phi = t * angle
            arc = (
                start
                + radius * np.sin(phi)[:, None] * u
                + radius * (1.0 - np.cos(phi))[:, None] * inward
            )
        self._points = np.vstack([hand, arc, shoulder])
        length = np.concatenate(
            [[0.0], np.cumsum(np.linalg.norm(np.diff(self._points, axis=0), axis=1))]
        )
        half = 1 + _SAMPLES // 2
        self._s = np.where(
            np.arange(len(length)) <= half,
            length / length[half],
            1.0 + (length - length[half]) / (length[-1] - length[half]),
        )
        tangent = np.vstack([u, _arc_tangents(u, w, angle, t), w])
        self._tangent = tangent

    def G(self, s: float) -> FloatArray:  # noqa: N802
        """Returns the point (3,) of the axis at `s`, limited to [0, 2], m."""
        s = min(2.0, max(0.0, s))
        return np.array([np.interp(s, self._s, self._points[:, i]) for i in range(3)])

    def D(self, s: float) -> FloatArray:  # noqa: N802
        """Returns the unit direction (3,) hand → shoulder at `s`, limited to [0, 2]."""
        s = min(2.0, max(0.0, s))
        d = np.array([np.interp(s, self._s, self._tangent[:, i]) for i in range(3)])
        unit: FloatArray = d / np.linalg.norm(d)
        return unit

    def coordinates(self, point: FloatArray) -> tuple[float, float, float]:
        """Returns (s, l, theta) of a point (3,): progress, distance to the axis, m, angle, rad.

        theta is zero along (p_e − p_h) × (p_s − p_e), or along a fixed normal of a straight arm.
        """
        a, b = self._points[:-1], self._points[1:]
        d = b - a
        t = np.clip(np.einsum("ij,ij->i", point - a, d) / np.einsum("ij,ij->i", d, d), 0.0, 1.0)
        foot = a + t[:, None] * d
        distance = np.linalg.norm(point - foot, axis=1)
        k = int(np.argmin(distance))
        s = float(self._s[k] + t[k] * (self._s[k + 1] - self._s[k]))
        direction = self.D(s)
        reference = self._reference - (self._reference @ direction) * direction
        if np.linalg.norm(reference) < 1e-9:
            reference = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
        reference = reference / np.linalg.norm(reference)
        offset = point - foot[k]
        theta = float(np.arctan2(offset @ np.cross(direction, reference), offset @ reference))
        return s, float(distance[k]), theta


def _arc_tangents(u: FloatArray, w: FloatArray, angle: float, t: FloatArray) -> FloatArray:
    if angle < 1e-6:
        return np.tile(u, (len(t), 1))
    inward = w - (w @ u) * u
    inward = inward / np.linalg.norm(inward)
    phi = (t * angle)[:, None]
    tangents: FloatArray = np.cos(phi) * u + np.sin(phi) * inward
    return tangents
