"""Measured logs: HDF5 in the layout of `run.h5`, NPZ with the same names, CSV with a column each.

A file holds one recording, or several as groups `recording_0`, `recording_1`, …. Names:

    time                                (T,) s, strictly increasing
    gripper/{left,right}/position       (T,3) m
    gripper/{left,right}/force          (T,3) N, of the garment on the gripper; may lack
    garment/marker_position             (T,m,3) m, NaN where not seen
    garment/marker_rest_position        (m,3) m, garment frame; or garment/marker_node (m,)
    human/joint_position                (T,6,3) m; may lack

An HDF5 dataset's attribute `noise_std` is its noise; without it the noise is estimated. A CSV has
columns such as `gripper/left/position/x` and `garment/marker_position/12/z`, empty where a marker
was not seen, and a file `NAME.markers.csv` beside it with the columns marker, x, y, z. A group's
attribute `motion`, one word, is what its recording is called.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from drake_dress.discrepancy.recording import Recording
from drake_dress.errors import UserError
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES

FloatArray = npt.NDArray[np.float64]

# Fewest samples and markers that say anything, and shortest recording, s.
_LEAST_SAMPLES, _LEAST_MARKERS, _SHORTEST = 20, 4, 0.5
# A garment is no larger and no farther than this, m: else the unit is not metres.
_FARTHEST = 20.0
# Noise is never taken below this, m and N.
_LEAST_NOISE, _LEAST_FORCE_NOISE = 1e-4, 1e-3
_FORMATS = ".h5, .hdf5, .npz or .csv"


def read_recordings(paths: Sequence[str | Path], mesh: GarmentMesh) -> list[Recording]:
    """Returns all recordings of all files.

    Args:
        paths: files.
        mesh: the scenario's garment, for markers that are given as nodes of it.

    Raises:
        UserError: a file cannot be used; says where and why.
    """
    recordings: list[Recording] = []
    for path in paths:
        path = Path(path)
        if not path.is_file():
            raise UserError(str(path), "", "no such file, expected a measured log")
        kind = path.suffix.lower()
        if kind in (".h5", ".hdf5"):
            found = _read_hdf5(path)
        elif kind == ".npz":
            found = _read_npz(path)
        elif kind == ".csv":
            found = _read_csv(path)
        else:
            raise UserError(str(path), "", f"is of unknown kind {kind!r}, expected {_FORMATS}")
        for name, title, arrays, noise in found:
            r = _recording(str(path), name, arrays, noise, mesh)
            alike = sum(other.name.split(" ")[0] == title for other in recordings)
            more = f" {alike + 1}" if alike else ""
            recordings.append(replace(r, name=title + more) if title else r)
    counts = {len(r.marker_rest_position) for r in recordings}
    if not counts:
        raise UserError(str(paths[0]), "", "holds no recording")
    return recordings


Arrays = Mapping[str, npt.NDArray[Any]]
# Group and what was done in it, both may be empty; datasets, and the noise of some.
_Found = tuple[str, str, Arrays, dict[str, float]]
_NAMES = (
    "time",
    *(f"gripper/{side}/{q}" for side in SIDES for q in ("position", "force")),
    "garment/marker_position",
    "garment/marker_rest_position",
    "garment/marker_node",
    "garment/rest_position",
    "human/joint_position",
)


def _groups(names: Sequence[str]) -> list[str]:
    """Returns the prefixes of the recordings among dataset names."""
    found = {n.split("/")[0] for n in names if n.startswith("recording_") and "/" in n}
    if not found:
        return [""]
    return [f"{g}/" for g in sorted(found, key=lambda g: (len(g), g))]


def _read_hdf5(path: Path) -> list[_Found]:
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise UserError(str(path), "", "is not a readable HDF5 file") from error
    with file:
        names: list[str] = []
        file.visit(names.append)
        found: list[_Found] = []
        for group in _groups(names):
            arrays: dict[str, npt.NDArray[Any]] = {}
            noise = {}
            for name in _NAMES:
                # what does not change between recordings may stand once, at the root
                data = file.get(f"{group}{name}", file.get(name))
                if not isinstance(data, h5py.Dataset):
                    continue
                arrays[name] = np.asarray(data)
                if "noise_std" in data.attrs:
                    noise[name] = float(np.max(data.attrs["noise_std"]))
            motion = file[group or "/"].attrs.get("motion", "")
            title = motion if isinstance(motion, str) and " " not in motion else ""
            found.append((group.rstrip("/"), title, arrays, noise))
        return found


def _read_npz(path: Path) -> list[_Found]:
    try:
        with np.load(path, allow_pickle=False) as file:
            content = {name: file[name] for name in file.files}
    except (OSError, ValueError) as error:
        raise UserError(str(path), "", f"is not a readable NPZ file: {error}") from error
    found: list[_Found] = []
    for group in _groups(list(content)):
        arrays: Arrays = {
            name: content[f"{group}{name}"] if f"{group}{name}" in content else content[name]
            for name in _NAMES
            if f"{group}{name}" in content or name in content
        }
        noise = {
            name: float(content[f"{prefix}{name}/noise_std"])
            for name in arrays
            for prefix in ("", group)
            if f"{prefix}{name}/noise_std" in content
        }
        found.append((group.rstrip("/"), "", arrays, noise))
    return found


def _read_csv(path: Path) -> list[_Found]:
    header, table = _table(path)
    arrays: dict[str, npt.NDArray[Any]] = {}
    if "time" in header:
        arrays["time"] = table[:, header.index("time")]
    for name, points in (
        *((f"gripper/{side}/{q}", None) for side in SIDES for q in ("position", "force")),
        ("garment/marker_position", "marker"),
        ("human/joint_position", "joint"),
    ):
        if points is None:
            columns = [f"{name}/{axis}" for axis in "xyz"]
            if any(c in header for c in columns):
                arrays[name] = table[:, [_column(path, header, c) for c in columns]]
            continue
        numbers = sorted(
            {int(h.split("/")[2]) for h in header if h.startswith(f"{name}/") and _numbered(h)}
        )
        if not numbers:
            continue
        if numbers != list(range(len(numbers))):
            missing = min(set(range(len(numbers))) - set(numbers))
            raise UserError(str(path), f"{name}/{missing}", "column is missing")
        columns = [f"{name}/{k}/{axis}" for k in numbers for axis in "xyz"]
        data = table[:, [_column(path, header, c) for c in columns]]
        arrays[name] = data.reshape(len(table), len(numbers), 3)
    beside = path.with_suffix(".markers.csv")
    if beside.is_file():
        names, rows = _table(beside)
        order = rows[:, _column(beside, names, "marker")].argsort()
        axes = [_column(beside, names, axis) for axis in "xyz"]
        arrays["garment/marker_rest_position"] = rows[order][:, axes]
    return [("", "", arrays, {})]


def _numbered(column: str) -> bool:
    parts = column.split("/")
    return len(parts) == 4 and parts[2].isdigit() and parts[3] in "xyz"


def _table(path: Path) -> tuple[list[str], FloatArray]:
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UserError(str(path), "", f"cannot be read as CSV: {error}") from error
    if len(rows) < 2:
        raise UserError(str(path), "", "is empty, expected a header and a row a sample")
    header = [h.strip().lstrip("/") for h in rows[0]]
    table = np.full((len(rows) - 1, len(header)), np.nan)
    for i, row in enumerate(rows[1:]):
        if len(row) != len(header):
            raise UserError(
                str(path), f"line {i + 2}", f"has {len(row)} values, expected {len(header)}"
            )
        for j, text in enumerate(row):
            if text.strip() == "":
                continue
            try:
                table[i, j] = float(text)
            except ValueError:
                raise UserError(
                    str(path), f"line {i + 2}", f"{header[j]} is {text!r}, expected a number"
                ) from None
    return header, table


def _column(path: Path, header: list[str], name: str) -> int:
    if name not in header:
        raise UserError(str(path), name, "column is missing")
    return header.index(name)


def _recording(
    source: str, name: str, arrays: Arrays, noise: Mapping[str, float], mesh: GarmentMesh
) -> Recording:
    def key(dataset: str) -> str:
        return f"{name}/{dataset}" if name else dataset

    def take(dataset: str, shape: tuple[int | None, ...], gaps: bool = False) -> FloatArray:
        if dataset not in arrays:
            raise UserError(source, key(dataset), "is missing")
        try:
            value = np.asarray(arrays[dataset], dtype=np.float64)
        except (TypeError, ValueError):
            raise UserError(source, key(dataset), "does not hold numbers") from None
        fits = len(value.shape) == len(shape) and all(
            want is None or want == got for want, got in zip(shape, value.shape, strict=True)
        )
        if not fits:
            wanted = ", ".join("any" if s is None else str(s) for s in shape)
            raise UserError(source, key(dataset), f"has shape {value.shape}, expected ({wanted})")
        bad = np.isinf(value) if gaps else ~np.isfinite(value)
        if bad.any():
            where = tuple(int(i) for i in np.argwhere(bad)[0])
            raise UserError(
                source, key(dataset), f"is {value[where]} at {where}, expected finite numbers"
            )
        return value

    time = take("time", (None,))
    count = len(time)
    if count < _LEAST_SAMPLES:
        raise UserError(
            source, key("time"), f"has {count} samples, expected {_LEAST_SAMPLES} or more"
        )
    if np.any(np.diff(time) <= 0.0):
        at = int(np.argmax(np.diff(time) <= 0.0)) + 1
        raise UserError(
            source, key("time"), f"does not increase at sample {at}, expected strictly increasing"
        )
    if time[-1] - time[0] < _SHORTEST:
        raise UserError(
            source, key("time"), f"covers {time[-1] - time[0]:.3g} s, expected {_SHORTEST} or more"
        )
    gripper = np.stack([take(f"gripper/{side}/position", (count, 3)) for side in SIDES], axis=1)
    marker = take("garment/marker_position", (count, None, 3), gaps=True)
    number = marker.shape[1]
    if number < _LEAST_MARKERS:
        raise UserError(
            source,
            key("garment/marker_position"),
            f"has {number} markers, expected {_LEAST_MARKERS} or more",
        )
    seen: npt.NDArray[np.bool_] = np.asarray(np.isfinite(marker).all(axis=2))
    marker = np.where(seen[:, :, None], marker, np.nan)
    if seen.any(axis=0).sum() < _LEAST_MARKERS:
        raise UserError(
            source,
            key("garment/marker_position"),
            f"{int(seen.any(axis=0).sum())} markers are ever seen, "
            f"expected {_LEAST_MARKERS} or more",
        )
    far = float(np.nanmax(np.abs(marker)))
    if far > _FARTHEST:
        raise UserError(
            source,
            key("garment/marker_position"),
            f"reaches {far:.4g} m from the origin, expected metres, up to {_FARTHEST:g}",
        )
    if "garment/marker_rest_position" in arrays:
        rest = take("garment/marker_rest_position", (number, 3))
    elif "garment/marker_node" in arrays:
        node = take("garment/marker_node", (number,)).astype(int)
        points = mesh.rest_position
        if "garment/rest_position" in arrays:
            points = take("garment/rest_position", (None, 3))
        if node.min() < 0 or node.max() >= len(points):
            raise UserError(
                source,
                key("garment/marker_node"),
                f"holds {int(node.max())}, expected nodes from 0 to {len(points) - 1}",
            )
        rest = points[node]
    else:
        raise UserError(
            source,
            key("garment/marker_rest_position"),
            "is missing, expected it or garment/marker_node",
        )
    force = None
    if all(f"gripper/{side}/force" in arrays for side in SIDES):
        force = np.stack(
            [take(f"gripper/{side}/force", (count, 3), gaps=True) for side in SIDES], axis=1
        )
    joints = None
    if "human/joint_position" in arrays:
        joints = take("human/joint_position", (count, 6, 3))
    marker_noise = noise.get("garment/marker_position", _estimated(marker, _LEAST_NOISE))
    force_noise = 0.05
    if force is not None:
        force_noise = noise.get("gripper/left/force", _estimated(force, _LEAST_FORCE_NOISE))
    for dataset, value in (
        ("garment/marker_position", marker_noise),
        ("gripper/*/force", force_noise),
    ):
        if not (np.isfinite(value) and value > 0.0):
            raise UserError(source, key(dataset), f"has noise_std {value}, expected above 0")
    return Recording(
        name or Path(source).stem,
        time,
        gripper,
        marker,
        rest,
        force,
        joints,
        marker_noise,
        force_noise,
    )


def _estimated(values: FloatArray, least: float) -> float:
    """Returns the noise (standard deviation of a coordinate) of values (T,k,3).

    From second differences, which still and steady phases leave to the noise: their median size,
    over the quietest half of the time.
    """
    second = values[2:] - 2.0 * values[1:-1] + values[:-2]
    size = np.nanmedian(np.abs(second), axis=(1, 2))
    quiet = size <= np.nanmedian(size)
    # the median of |N(0, 6 σ²)| is 0.6745 √6 σ
    return max(float(np.nanmedian(np.abs(second[quiet]))) / (0.6745 * np.sqrt(6.0)), least)
