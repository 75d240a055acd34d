"""A recording made up without a simulation: a jacket that hangs, sways and sheds no marker."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from drake_dress.discrepancy.recording import Recording
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.sampling import spread_out
from tests.present import present

Datasets = dict[str, FloatArray]

MESH = make_coat(COATS["jacket"], 0.06)
DENSITY = 0.3
JOINTS = np.array(
    [
        [-0.1, 0.2, 1.4],
        [-0.1, 0.5, 1.4],
        [-0.1, 0.75, 1.4],
        [-0.1, -0.2, 1.4],
        [-0.1, -0.25, 1.1],
        [-0.1, -0.25, 0.85],
    ]
)


def hanging(
    rng: np.random.Generator,
    rate: float = 100.0,
    duration: float = 2.0,
    markers: int = 24,
    noise: float = 1e-3,
) -> Recording:
    """Returns a recording; the garment is at rest for 0.4 s, then sways by about 10 cm at 1 Hz."""
    time = np.arange(round(rate * duration) + 1) / rate
    nodes = spread_out(MESH.rest_position, markers, int(rng.integers(len(MESH.rest_position))))
    places = MESH.rest_position[nodes]
    began = np.clip(time - 0.4, 0.0, None)
    swing = 0.1 * np.sin(2.0 * np.pi * rng.uniform(0.7, 1.1) * began) * np.minimum(began, 1.0)
    turned = np.deg2rad(rng.uniform(-40.0, 40.0))
    c, s = np.cos(turned), np.sin(turned)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    away = np.array([-0.8, 0.1, 1.5]) + swing[:, None] * [0.6, 0.8, 0.1]
    # the hem follows, and flutters
    late = 0.03 * np.sin(9.0 * began)[:, None] * places[:, 2] / 0.6
    marker = places @ rotation.T + away[:, None] + late[:, :, None] * [1.0, 0.0, 0.0]
    grasp = np.stack([MESH.rest_position[MESH.grasp[k]].mean(axis=0) for k in ("left", "right")])
    gripper = grasp @ rotation.T + away[:, None]
    a, b, d = (MESH.rest_position[MESH.faces[:, k]] for k in range(3))
    weight = 9.81 * DENSITY * 0.5 * np.linalg.norm(np.cross(b - a, d - a), axis=1).sum()
    force = np.zeros((len(time), 2, 3))
    force[:, :, 2] = -0.5 * weight
    return Recording(
        "sway",
        time,
        gripper,
        marker + noise * rng.standard_normal(marker.shape),
        places,
        force + 0.05 * rng.standard_normal(force.shape),
        np.tile(JOINTS, (len(time), 1, 1)),
        noise,
        0.05,
    )


def arrays(recording: Recording) -> Datasets:
    """Returns the datasets of a recording by their names."""
    r = recording
    found = {
        "time": r.time,
        "garment/marker_position": r.marker_position,
        "garment/marker_rest_position": r.marker_rest_position,
        "human/joint_position": present(r.joint_position),
    }
    for k, side in enumerate(("left", "right")):
        found[f"gripper/{side}/position"] = r.gripper_position[:, k]
        found[f"gripper/{side}/force"] = present(r.gripper_force)[:, k]
    return {name: np.array(value) for name, value in found.items()}


def write_hdf5(path: Path, datasets: Mapping[str, FloatArray], compression: str = "gzip") -> Path:
    """Writes datasets as an HDF5 file with one recording at its root."""
    with h5py.File(path, "w") as file:
        for name, value in datasets.items():
            file.create_dataset(name, data=value, compression=compression)
    return path


def write_npz(path: Path, datasets: Mapping[str, Any]) -> Path:
    """Writes datasets as an NPZ file."""
    np.savez(path, **datasets)
    return path


def csv_text(
    datasets: Mapping[str, FloatArray], divider: str = ",", number: Callable[[float], str] = repr
) -> str:
    """Returns a recording as the text of a CSV, markers' numbers as they stand."""
    columns = {"time": datasets["time"]}
    for name, value in datasets.items():
        if name in ("time", "garment/marker_rest_position"):
            continue
        for index in np.ndindex(value.shape[1:]):
            *point, axis = index
            columns["/".join([name, *map(str, point), "xyz"[axis]])] = value[(slice(None), *index)]
    rows = [list(columns)]
    for row in zip(*columns.values(), strict=True):
        rows.append(["" if np.isnan(v) else number(float(v)) for v in row])
    return "".join(divider.join(row) + "\n" for row in rows)


def places_text(
    places: FloatArray, numbers: Iterable[object] | None = None, divider: str = ","
) -> str:
    """Returns the text of `NAME.markers.csv`."""
    numbers = range(len(places)) if numbers is None else numbers
    rows = [["marker", "x", "y", "z"]]
    rows += [[str(k), *(repr(float(v)) for v in p)] for k, p in zip(numbers, places, strict=True)]
    return "".join(divider.join(row) + "\n" for row in rows)
