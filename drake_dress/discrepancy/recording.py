"""What was measured: one recording, SI units, in the world that cameras and robot report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from drake_dress.models.arrays import BoolArray, FloatArray

# Sightings that a parabola is fitted to, at least.
_LEAST_SEEN = 3


@dataclass(frozen=True)
class Recording:
    """One recording of a garment that two grippers hold.

    Attributes:
        name: for messages and plots.
        time: (T,) s, strictly increasing.
        gripper_position: (T,2,3) of the left and the right gripper, m.
        marker_position: (T,m,3) m; NaN where a marker was not seen.
        marker_rest_position: (m,3) where markers sit on the rest shape, garment frame, m.
        gripper_force: (T,2,3) of the garment on the grippers, N; None where not measured.
        joint_position: (T,6,3) shoulder, elbow, hand of left, then of right, m; None likewise.
        marker_noise: standard deviation of a coordinate, m.
        force_noise: of a component, N.
        notes: what of the file was not used, or not taken as it stands.
    """

    name: str
    time: FloatArray
    gripper_position: FloatArray
    marker_position: FloatArray
    marker_rest_position: FloatArray
    gripper_force: FloatArray | None = None
    joint_position: FloatArray | None = None
    marker_noise: float = 1e-3
    force_noise: float = 0.05
    notes: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """From first to last sample, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def gripper_path(self) -> CubicSpline:
        """The grippers' way through all that was recorded, time to (2,3), m."""
        return CubicSpline(self.time, self.gripper_position, axis=0, bc_type="natural")


def smoothed(
    time: FloatArray, position: FloatArray, half_window: float = 0.045
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Returns position, velocity and where they are known, of points seen with gaps.

    A parabola is fitted to what was seen within the window around each time.

    Args:
        time: (T,) s.
        position: (T,m,3) m, NaN where not seen.
        half_window: s.

    Returns:
        (T,m,3) m, (T,m,3) m/s, zero where not known, and (T,m).
    """
    count, markers = position.shape[:2]
    seen: BoolArray = np.asarray(np.isfinite(position).all(axis=2))
    filled = np.where(seen[:, :, None], position, 0.0)
    x, v = np.zeros_like(filled), np.zeros_like(filled)
    known = np.zeros((count, markers), dtype=np.bool_)
    first = np.searchsorted(time, time - half_window)
    last = np.searchsorted(time, time + half_window, side="right")
    for j in range(count):
        s = slice(first[j], last[j])
        t = (time[s] - time[j]) / half_window
        powers = np.stack([np.ones_like(t), t, t * t])
        weight = seen[s].astype(np.float64)
        normal = np.einsum("at,bt,tm->mab", powers, powers, weight)
        right = np.einsum("at,tm,tmc->mac", powers, weight, filled[s])
        # both sides of the instant must have been seen, or the parabola is a guess
        enough = (weight.sum(axis=0) >= _LEAST_SEEN) & (
            (weight * (t[:, None] < 0.5)).sum(axis=0) * (weight * (t[:, None] > -0.5)).sum(axis=0)
            > 0
        )
        normal[~enough] = np.eye(3)
        fit = np.linalg.solve(normal + 1e-9 * np.eye(3), right)
        x[j, enough], v[j, enough] = fit[enough, 0], fit[enough, 1] / half_window
        known[j] = enough
    return x, v, known
