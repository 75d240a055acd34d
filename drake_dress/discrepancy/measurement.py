"""A recording as arrays in a user's program, before it is checked against a garment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.discrepancy.reading.raw import (
    JOINTS,
    MARKERS,
    NODES,
    PLACES,
    RawRecording,
    check_content,
    noise_std,
)
from drake_dress.errors import UserError
from drake_dress.models.sides import SIDES


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """One recording of a garment that two grippers hold; SI units, world frame, z up.

    `explain` and `check_recordings` check it against the scenario's garment, like a file. See
    `docs/explain.md` for what they refuse.

    Args:
        time: (T,) time stamps, strictly increasing, s.
        gripper_position: (T,2,3) positions of the left and the right gripper, m.
        marker_position: (T,m,3) positions of the markers, m; NaN where a marker was not seen.
        marker_rest_position: (m,3) positions of the markers on the rest shape, garment frame, m.
        marker_node: (m,) nodes of the scenario's garment, in place of `marker_rest_position`.
        gripper_force: (T,2,3) force of the garment on the grippers, N; None if not measured.
        joint_position: (T,6,3) shoulder, elbow, hand of the left, then the right arm, m; None if
            not measured.
        marker_noise: standard deviation of a coordinate, m; estimated if None.
        force_noise: standard deviation of a component, N; estimated if None.
        name: name in messages and plots.

    Raises:
        UserError: an array or a noise cannot be used, or not exactly one of `marker_rest_position`
            and `marker_node` is given.
    """

    time: npt.ArrayLike
    gripper_position: npt.ArrayLike
    marker_position: npt.ArrayLike
    marker_rest_position: npt.ArrayLike | None = None
    marker_node: npt.ArrayLike | None = None
    gripper_force: npt.ArrayLike | None = None
    joint_position: npt.ArrayLike | None = None
    marker_noise: float | None = None
    force_noise: float | None = None
    name: str = "recording"

    def __post_init__(self) -> None:
        if (self.marker_rest_position is None) == (self.marker_node is None):
            raise UserError(
                self.name,
                "marker_rest_position",
                "expected it or marker_node, and not both",
            )
        self.raw()

    def raw(self) -> RawRecording:
        """Returns the recording in the form that the readers of files return."""
        arrays = {
            dataset: self._array(field)
            for dataset, field in _WHOLE.items()
            if getattr(self, field) is not None
        }
        for field, end in _PER_GRIPPER.items():
            if getattr(self, field) is not None:
                both = self._array(field)
                if both.ndim != 3 or both.shape[1:] != (2, 3):
                    raise UserError(
                        self.name, field, f"has shape {both.shape}, expected (time, 2, 3)"
                    )
                for k, side in enumerate(SIDES):
                    arrays[f"gripper/{side}/{end}"] = both[:, k]
        noise = {}
        for field, dataset in _NOISE.items():
            if getattr(self, field) is not None:
                noise[dataset], _ = noise_std(self.name, field, getattr(self, field))
        return RawRecording(self.name, "", self.name, arrays, noise, {}, tuple(arrays))

    def _array(self, field: str) -> npt.NDArray[np.generic]:
        value = np.asarray(getattr(self, field))
        check_content(self.name, field, value.dtype, value.shape)
        return value


# Correspondence of a file's datasets and the fields of `Measurement`.
_WHOLE = {
    "time": "time",
    MARKERS: "marker_position",
    PLACES: "marker_rest_position",
    NODES: "marker_node",
    JOINTS: "joint_position",
}
_PER_GRIPPER = {"gripper_position": "position", "gripper_force": "force"}
_NOISE = {"marker_noise": MARKERS, "force_noise": f"gripper/{SIDES[0]}/force"}
