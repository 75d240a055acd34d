"""Reads one recording and brings it into metres, seconds and a frame whose z axis points up.

What a file does not say is found where the body tells it: the unit by the lengths of the limbs,
which way is up by how arms hang. It is said what was found, so that a wrong guess is seen. Nothing
tells a missing rate: without stamps it has to be given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from drake_dress.errors import UserError
from drake_dress.learning.recordings.columns import columns_of, read_table
from drake_dress.learning.timed_motion import TimedMotion
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.prediction import LIMBS

UPS = ("x", "-x", "y", "-y", "z", "-z")
# Units by which files give lengths, m.
_UNITS = {"m": 1.0, "dm": 0.1, "in": 0.0254, "cm": 0.01, "mm": 0.001, "0.1 mm": 1e-4}
# Median length of upper arms and forearms, m: from small children to tall adults, and of most
# adults. No length of a limb in a file fits two units.
_LIMBS, _ADULT = (0.15, 0.36), 0.27
# A direction counts as down if arms hang along it by this share of their length on average.
_HANGING = 0.3
_FEWEST = 5  # samples with a joint


@dataclass(frozen=True)
class RecordingOptions:
    """What the user says of a recording; None where it is to be found.

    Attributes:
        rate: Hz, for files without stamps.
        up: axis of the file that points up, one of `UPS`.
        unit: length of the file's unit, m.
    """

    rate: float | None = None
    up: str | None = None
    unit: float | None = None


def read_recording(
    path: Path,
    options: RecordingOptions = RecordingOptions(),
    told: Callable[[str], None] = lambda _: None,
) -> TimedMotion:
    """Returns the motion in a file.

    Formats: `.npz` with `joint_position` (T,6,3) or (T,3,3) and `time` (T,); `.h5` with
    `/human/joint_position` and `/time`, as run.h5 has them; `.csv`, `.tsv`, `.txt` with a header
    that names side, joint and axis of each column, such as `left_shoulder_x` or `RWrist.z`.

    Args:
        path: of the file.
        options: what the user says of it.
        told: called with what was found.

    Raises:
        UserError: the file cannot be used.
    """
    if not path.is_file():
        raise UserError(str(path), "", "no such file, expected a recording of joint positions")
    time, joints = _read(path)
    if time is None:
        if options.rate is None:
            raise UserError(str(path), "time", "has no column or array of time, expected --rate HZ")
        time = np.arange(len(joints)) / options.rate
    time, joints = _ordered(path, time, joints)
    unit = _unit(path, joints, told) if options.unit is None else options.unit
    joints = joints * unit
    up = _up(path, joints, told) if options.up is None else options.up
    joints = turned_up(joints, up)
    sleeves = np.full((len(time), 2, 6), np.nan)
    return TimedMotion(path.stem, time, joints, sleeves)


def turned_up(points: FloatArray, up: str) -> FloatArray:
    """Returns points (…,3) in a frame whose z axis is the axis `up` of theirs, one of `UPS`."""
    sign = -1.0 if up.startswith("-") else 1.0
    axis = "xyz".index(up[-1])
    # a rotation: the three axes move on in their order, and two of them change sign if up does
    order = [(axis + 1) % 3, (axis + 2) % 3, axis]
    turned: FloatArray = points[..., order] * np.array([1.0, sign, sign])
    return turned


def _read(path: Path) -> tuple[FloatArray | None, FloatArray]:
    kinds = {".npz": _read_npz, ".h5": _read_hdf5, ".hdf5": _read_hdf5}
    reader = kinds.get(path.suffix.lower(), _read_text)
    time, joints = reader(path)
    if joints.ndim != 3 or joints.shape[1:] not in ((6, 3), (3, 3)):
        raise UserError(
            str(path),
            "joint_position",
            f"has shape {list(joints.shape)}, expected (T,6,3) shoulder, elbow, hand of left, then "
            "right arm, or (T,3,3) of the right arm",
        )
    if joints.shape[1] == 3:
        joints = np.concatenate([np.full_like(joints, np.nan), joints], axis=1)
    if time is not None and time.shape != (len(joints),):
        raise UserError(
            str(path), "time", f"has shape {list(time.shape)}, expected ({len(joints)},)"
        )
    return time, joints


def _read_npz(path: Path) -> tuple[FloatArray | None, FloatArray]:
    try:
        with np.load(path, allow_pickle=False) as file:
            if "joint_position" not in file:
                raise UserError(
                    str(path), "joint_position", f"is missing; found {', '.join(file.files)}"
                )
            time = np.asarray(file["time"], dtype=np.float64) if "time" in file else None
            return time, np.asarray(file["joint_position"], dtype=np.float64)
    except (OSError, ValueError, KeyError) as error:
        raise UserError(str(path), "", "cannot be read as .npz of numbers") from error


def _read_hdf5(path: Path) -> tuple[FloatArray | None, FloatArray]:
    name = "/human/joint_position"
    try:
        with h5py.File(path, "r") as file:
            if name not in file:
                raise UserError(str(path), name, "is missing, expected (T,6,3)")
            time = np.asarray(file["/time"], dtype=np.float64) if "/time" in file else None
            return time, np.asarray(file[name], dtype=np.float64)
    except (OSError, ValueError, TypeError) as error:
        raise UserError(str(path), "", "cannot be read as HDF5") from error


def _read_text(path: Path) -> tuple[FloatArray | None, FloatArray]:
    header, rows = read_table(path)
    found = columns_of(path, header)
    joints = np.full((len(rows), 6, 3), np.nan)
    for (joint, axis), column in found.points.items():
        joints[:, joint, axis] = rows[:, column]
    time = None if found.time is None else rows[:, found.time] * found.time_unit
    return time, joints


def _ordered(path: Path, time: FloatArray, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns rows with finite, increasing stamps; repeated stamps are left out."""
    good = np.isfinite(time)
    time, joints = time[good], joints[good]
    if np.any(np.diff(time) < 0.0):
        raise UserError(str(path), "time", "decreases, expected stamps in order")
    new = np.concatenate([[True], np.diff(time) > 0.0]) if len(time) else good[:0]
    time, joints = time[new], joints[new]
    incomplete = ~np.all(np.isfinite(joints), axis=2)
    joints[incomplete] = np.nan
    seen = (~incomplete).sum(axis=0)
    if not any((seen[3 * arm : 3 * arm + 3] >= _FEWEST).all() for arm in (0, 1)):
        raise UserError(
            str(path), "", "has no arm with shoulder, elbow and hand in five samples or more"
        )
    return time, joints


def _unit(path: Path, joints: FloatArray, told: Callable[[str], None]) -> float:
    length = float(np.median(_limb_lengths(joints)))
    fitting = {
        name: unit for name, unit in _UNITS.items() if _LIMBS[0] <= length * unit <= _LIMBS[1]
    }
    if not fitting:
        raise UserError(
            str(path),
            "unit",
            f"is not known: limbs are {length:.4g} long, expected {_LIMBS[0]} to {_LIMBS[1]} m in "
            f"{', '.join(_UNITS)}; give it by --unit, in which {_ADULT / length:.3g} would be an "
            "adult's",
        )
    name, unit = min(fitting.items(), key=lambda item: abs(length * item[1] - _ADULT))
    told(f"{path.name}: unit {name}, since limbs are {length:.4g} long")
    return unit


def _up(path: Path, joints: FloatArray, told: Callable[[str], None]) -> str:
    arms = [joints[:, 3 * arm + 2] - joints[:, 3 * arm] for arm in (0, 1)]
    hanging = np.nanmean(np.concatenate(arms), axis=0)
    length = 2.0 * float(np.median(_limb_lengths(joints)))
    axis = int(np.argmax(np.abs(hanging)))
    if abs(hanging[axis]) < _HANGING * length:
        raise UserError(
            str(path), "up", "is not known: arms do not hang along any axis; give it by --up z"
        )
    up = ("-" if hanging[axis] > 0.0 else "") + "xyz"[axis]
    told(f"{path.name}: {up} points up, since arms hang the other way")
    return up


def _limb_lengths(joints: FloatArray) -> FloatArray:
    """Returns the lengths (k,) of all limbs whose both ends are known at a time."""
    found = [np.linalg.norm(joints[:, b] - joints[:, a], axis=1) for a, b in LIMBS]
    every = np.concatenate(found)
    return every[np.isfinite(every)]
