"""A measured recording, in SI units and in the world frame that cameras and robot report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from drake_dress.models.arrays import BoolArray, FloatArray

# Fewest observations to which a parabola is fitted.
_LEAST_SEEN = 3


@dataclass(frozen=True)
class Recording:
    """One recording of a garment that two grippers hold.

    Attributes:
        name: name in messages and plots.
        time: (T,) time stamps, strictly increasing, s.
        gripper_position: (T,2,3) positions of the left and the right gripper, m.
        marker_position: (T,m,3) positions of the markers, m; NaN where a marker was not seen.
        marker_rest_position: (m,3) positions of the markers on the rest shape, garment frame, m.
        gripper_force: (T,2,3) force of the garment on the grippers, N; None if not measured.
        joint_position: (T,6,3) shoulder, elbow, hand of the left, then the right arm, m; None if
            not measured.
        marker_noise: standard deviation of a coordinate, m.
        force_noise: standard deviation of a component, N.
        notes: which data of the file were not used, or were changed.
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
        """Time from the first to the last sample, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def gripper_path(self) -> CubicSpline:
        """Spline through the recorded gripper positions, from time, s, to (2,3), m."""
        return CubicSpline(self.time, self.gripper_position, axis=0, bc_type="natural")


def smoothed(
    time: FloatArray, position: FloatArray, half_window: float = 0.045
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Returns smoothed positions and velocities of points seen with gaps, and where they are known.

    A parabola is fitted to the observations within a window around each time.

    Args:
        time: (T,) s.
        position: (T,m,3) m, NaN where not seen.
        half_window: half the width of the window, s.

    Returns:
        Positions (T,m,3), m, and velocities (T,m,3), m/s, both zero where not known; and (T,m)
        whether they are known.
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
        # without observations on both sides of the instant, the parabola would be a guess
        enough = (weight.sum(axis=0) >= _LEAST_SEEN) & (
            (weight * (t[:, None] < 0.5)).sum(axis=0) * (weight * (t[:, None] > -0.5)).sum(axis=0)
            > 0
        )
        normal[~enough] = np.eye(3)
        fit = np.linalg.solve(normal + 1e-9 * np.eye(3), right)
        x[j, enough], v[j, enough] = fit[enough, 0], fit[enough, 1] / half_window
        known[j] = enough
    return x, v, known
