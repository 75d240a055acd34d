"""Writes recordings as a measured log."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import h5py
import numpy as np

from drake_dress import __version__
from drake_dress.discrepancy.recording import Recording
from drake_dress.file_output import replacing
from drake_dress.models.sides import SIDES
from drake_dress.report.log_schema import JOINT_NAMES, SCHEMA


def write_recordings(path: Path, recordings: Sequence[Recording], scenario_text: str) -> None:
    """Writes an HDF5 file with a group for each recording; a failure leaves no partial file."""
    with replacing(path) as partial, h5py.File(partial, "w") as file:
        file.attrs["schema"] = SCHEMA
        file.attrs["scenario"] = scenario_text
        file.attrs["version"] = __version__
        for i, r in enumerate(recordings):
            group = file.create_group(f"recording_{i}")
            group.attrs["motion"] = r.name
            _add(group, "time", r.time, "s")
            for k, side in enumerate(SIDES):
                _add(group, f"gripper/{side}/position", r.gripper_position[:, k], "m", "world")
                if r.gripper_force is not None:
                    force = _add(
                        group, f"gripper/{side}/force", r.gripper_force[:, k], "N", "world"
                    )
                    force.attrs["noise_std"] = r.force_noise
            markers = _add(group, "garment/marker_position", r.marker_position, "m", "world")
            markers.attrs["noise_std"] = r.marker_noise
            _add(group, "garment/marker_rest_position", r.marker_rest_position, "m", "garment")
            if r.joint_position is not None:
                joints = _add(group, "human/joint_position", r.joint_position, "m", "world")
                joints.attrs["names"] = list(JOINT_NAMES)


def _add(
    group: h5py.Group, name: str, value: np.ndarray, unit: str, frame: str | None = None
) -> h5py.Dataset:
    data = group.create_dataset(name, data=value, compression="gzip", compression_opts=1)
    data.attrs["unit"] = unit
    if frame is not None:
        data.attrs["frame"] = frame
    return data
