"""HDF5 files of sequences: their layout, and writing and reading them.

Data are in compressed chunks of one sequence, each with a checksum, so that a part of a file can be
read and damage is noticed. Equal content gives equal files.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from drake_dress.errors import UserError
from drake_dress.file_output import replacing
from drake_dress.hdf5_state import Hdf5State, look_at
from drake_dress.learning.motion.sequence import PERIOD, Sequence
from drake_dress.models.sides import SIDES
from drake_dress.report.log_layout import label
from drake_dress.report.log_schema import INTENT_NAMES, JOINT_NAMES

SCHEMA = "drake_dress.motion/1"
_EXPECTED = "expected a file of `drake-dress dataset motion`"
# Series: name to (type, shape of a sample, unit, frame).
_SERIES: dict[str, tuple[str, tuple[int, ...], str, str | None]] = {
    "joint_position": ("f4", (6, 3), "m", "world"),
    "sleeve": ("f4", (2, 6), "m (center), 1 (direction)", "world"),
    "intent": ("u1", (2,), "1", None),
    "on": ("u1", (2,), "1", None),
}
_COLUMNS = [f"{part}_{axis}" for part in ("center", "direction") for axis in "xyz"]
_ON_NAMES = ("the arm is outside its sleeve", "the arm is in its sleeve")


@dataclass(frozen=True)
class MotionArrays:
    """n sequences of T samples, `PERIOD` apart.

    Attributes:
        joint_position: (n,T,6,3) shoulder, elbow, hand of left, then of right arm, m, world.
        sleeve: (n,T,2,6) centre, m, and unit direction from cuff to armhole, of left and right
            armhole, world; NaN without a garment.
        intent: (n,T,2) 1 where the arm moves by the person's own will, else 0; left, right.
        on: (n,T,2) 1 where the arm is in its sleeve, else 0; left, right.
    """

    joint_position: npt.NDArray[np.float32]
    sleeve: npt.NDArray[np.float32]
    intent: npt.NDArray[np.uint8]
    on: npt.NDArray[np.uint8]

    @staticmethod
    def of(sequences: Iterable[Sequence]) -> MotionArrays:
        """Returns the arrays of sequences with equal numbers of samples."""
        rows = [(s.joints, s.sleeves, s.intent, s.on) for s in sequences]
        return MotionArrays(
            *(
                np.stack(each).astype(kind)
                for each, (kind, *_) in zip(zip(*rows, strict=True), _SERIES.values(), strict=True)
            )
        )

    @staticmethod
    def joined(parts: Iterable[MotionArrays]) -> MotionArrays:
        """Returns the sequences of all parts, in order."""
        rows = [p.arrays().values() for p in parts]
        return MotionArrays(*(np.concatenate(each) for each in zip(*rows, strict=True)))

    def arrays(self) -> dict[str, npt.NDArray[Any]]:
        """Returns the arrays by their names in a file."""
        return {name: getattr(self, name) for name in _SERIES}

    def __len__(self) -> int:
        return len(self.joint_position)


@dataclass(frozen=True)
class Origin:
    """What made the sequences of a file.

    Attributes:
        kind: `passive`, `active`, `free` or `dressing`.
        seed: of the set.
        first: number of the file's first sequence within its kind.
        version: of drake_dress.
    """

    kind: str
    seed: int
    first: int
    version: str


@dataclass(frozen=True)
class MotionFile:
    """Content of a file.

    Attributes:
        origin: what made it.
        data: its sequences.
        notes: further attributes.
    """

    origin: Origin
    data: MotionArrays
    notes: Mapping[str, Any]


def write_motion(path: Path, content: MotionFile) -> None:
    """Writes a file; a failure leaves no partial file."""
    count = content.data.joint_position.shape[1]
    with replacing(path) as partial, h5py.File(partial, "w") as file:
        for name, value in {**content.notes, "schema": SCHEMA, **vars(content.origin)}.items():
            file.attrs[name] = value
        time = PERIOD * np.arange(count)
        label(file.create_dataset("time", data=time), "s", None)
        for name, array in content.data.arrays().items():
            _, _, unit, frame = _SERIES[name]
            dataset = file.create_dataset(
                name,
                data=array,
                chunks=(1, *array.shape[1:]),
                compression="gzip",
                shuffle=True,
                fletcher32=True,
            )
            label(dataset, unit, frame)
        file["joint_position"].attrs["names"] = list(JOINT_NAMES)
        file["sleeve"].attrs["names"] = list(SIDES)
        file["sleeve"].attrs["columns"] = _COLUMNS
        for name, values in (("intent", INTENT_NAMES), ("on", _ON_NAMES)):
            file[name].attrs["names"] = list(SIDES)
            file[name].attrs["values"] = list(values)


def read_origin(path: Path) -> Origin:
    """Returns what made a file.

    Raises:
        UserError: The file is missing, damaged or of another program.
    """
    with _opened(path) as file:
        return _origin(path, file)


def read_motion_file(path: Path, rows: slice = slice(None)) -> MotionFile:
    """Returns the sequences of a file, or some of them.

    Raises:
        UserError: The file is missing, damaged or of another program.
    """
    with _opened(path) as file:
        origin = _origin(path, file)
        try:
            _check_shapes(path, file)
            data = MotionArrays(*(np.asarray(file[name][rows]) for name in _SERIES))
        except (OSError, RuntimeError, KeyError) as error:
            raise UserError(str(path), "", f"is damaged: {error}; {_EXPECTED}") from error
        own = {"schema", *vars(origin)}
        return MotionFile(origin, data, {n: v for n, v in file.attrs.items() if n not in own})


def _opened(path: Path) -> h5py.File:
    try:
        found = look_at(path)
    except FileNotFoundError as error:
        raise UserError(str(path), "", f"no such file; {_EXPECTED}") from error
    except OSError as error:
        raise UserError(str(path), "", f"cannot be read: {error.strerror}; {_EXPECTED}") from error
    if found.state is not Hdf5State.SOUND:
        raise UserError(str(path), "", f"{found.message}; {_EXPECTED}")
    try:
        return h5py.File(path, "r")
    except OSError as error:
        message = f"is damaged: HDF5 cannot open it; {_EXPECTED}"
        raise UserError(str(path), "", message) from error


def _origin(path: Path, file: h5py.File) -> Origin:
    try:
        schema = file.attrs.get("schema")
        if schema != SCHEMA:
            raise UserError(str(path), "schema", f"is {schema!r}, expected {SCHEMA!r}")
        kind, seed, first, version = (file.attrs[n] for n in ("kind", "seed", "first", "version"))
        return Origin(str(kind), int(seed), int(first), str(version))
    except (OSError, RuntimeError, KeyError, TypeError, ValueError) as error:
        if isinstance(error, UserError):
            raise
        raise UserError(str(path), "", f"is damaged: {error}; {_EXPECTED}") from error


def _check_shapes(path: Path, file: h5py.File) -> None:
    sizes = file["joint_position"].shape[:2]
    for name, (kind, shape, *_) in _SERIES.items():
        dataset = file[name]
        if dataset.shape != (*sizes, *shape) or dataset.dtype != np.dtype(kind):
            message = f"has shape {dataset.shape} of {dataset.dtype}, expected {(*sizes, *shape)}"
            raise UserError(str(path), name, f"{message} of {kind}")
    if file["time"].shape != sizes[1:]:
        raise UserError(str(path), "time", f"has shape {file['time'].shape}, expected {sizes[1:]}")
