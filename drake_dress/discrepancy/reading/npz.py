"""Reads measured logs in NPZ: arrays with the same names as in HDF5."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from drake_dress.discrepancy.reading.raw import (
    MOST_BYTES,
    UNITS,
    RawRecording,
    check_content,
    check_unit,
    noise_std,
    recording_groups,
    unused_note,
)
from drake_dress.errors import UserError

# Errors that zipfile, zlib and NumPy raise on damaged, encrypted or unknown content.
_DAMAGED = (
    OSError,
    ValueError,
    EOFError,
    KeyError,
    TypeError,
    SyntaxError,
    RuntimeError,
    MemoryError,
    OverflowError,
    zipfile.BadZipFile,
    zlib.error,
)
# Largest size of an array's magic string, version and header, bytes.
_HEADER = 70_000
_ATTRIBUTES = ("noise_std", "unit", "units")


def read_npz(path: Path) -> list[RawRecording]:
    """Returns the recordings of an NPZ file.

    An array `NAME/noise_std` or `NAME/unit` stands for the HDF5 attribute of that name.

    Raises:
        UserError: the file or one of its arrays cannot be read.
    """
    source = str(path)
    try:
        with path.open("rb") as file:
            if file.read(6) == b"\x93NUMPY":
                raise UserError(source, "", "is a single array (NPY), expected an NPZ file")
        with zipfile.ZipFile(path) as archive:
            members = [m.filename for m in archive.infolist()]
            stems = [m.removesuffix(".npy") for m in members]
            for stem in stems:
                if stems.count(stem) > 1:
                    raise UserError(source, stem, "stands twice, expected each name once")
            wanted = {
                stem: _read(source, archive, member)
                for stem, member in zip(stems, members, strict=True)
                if member.endswith(".npy") and _is_known(stem)
            }
    except UserError:
        raise
    except _DAMAGED as error:
        reason = str(error) or type(error).__name__
        raise UserError(source, "", f"is not a readable NPZ file: {reason}") from error
    return [_recording(source, wanted, stems, group) for group in recording_groups(stems)]


def _is_known(stem: str) -> bool:
    """Returns whether an array of this name, in a group or not, is used."""
    parts = stem.split("/")
    if parts[0].startswith("recording_"):
        parts = parts[1:]
    if parts[-1] in _ATTRIBUTES:
        parts = parts[:-1]
    return "/".join(parts) in UNITS


def _read(source: str, archive: zipfile.ZipFile, member: str) -> npt.NDArray[Any]:
    """Returns one array; size, shape and type in its header are checked before it is read."""
    key = member.removesuffix(".npy")
    try:
        whole = archive.getinfo(member).file_size
        if whole > MOST_BYTES + _HEADER:
            raise UserError(
                source,
                key,
                f"has {whole / 2**30:.3g} GB, expected up to {MOST_BYTES / 2**30:g} GB",
            )
        with archive.open(member) as file:
            version = np.lib.format.read_magic(file)
            header = (
                np.lib.format.read_array_header_1_0
                if version == (1, 0)
                else np.lib.format.read_array_header_2_0
            )
            shape, _, kind = header(file)
        if key.split("/")[-1] not in ("unit", "units"):
            check_content(source, key, kind, shape)
        elif kind.hasobject:
            raise UserError(source, key, "holds Python objects, expected a text")
        with archive.open(member) as file:
            return np.asarray(np.lib.format.read_array(file, allow_pickle=False))
    except UserError:
        raise
    except _DAMAGED as error:
        reason = str(error) or type(error).__name__
        raise UserError(source, key, f"cannot be read: {reason}") from error


def _recording(
    source: str, content: dict[str, npt.NDArray[Any]], stems: list[str], group: str
) -> RawRecording:
    arrays, noise, notes, used = {}, {}, [], set()
    for name in UNITS:
        key = next((k for k in (group + name, name) if k in content), None)
        if key is None:
            continue
        arrays[name] = content[key]
        used.add(key)
        for attribute in _ATTRIBUTES:
            for where in dict.fromkeys((key, group + name, name)):
                value = content.get(f"{where}/{attribute}")
                if value is None:
                    continue
                used.add(f"{where}/{attribute}")
                if attribute == "noise_std" and name not in noise:
                    noise[name], note = noise_std(source, key, value)
                    notes += [note] if note else []
                elif attribute != "noise_std":
                    check_unit(source, key, name, str(value))
    mine = [s for s in stems if s.startswith(group) or not s.startswith("recording_")]
    names = tuple(s[len(group) :] if s.startswith(group) else s for s in mine)
    unused = unused_note([s for s in mine if s not in used])
    return RawRecording(source, group.rstrip("/"), "", arrays, noise, {}, names, (*notes, *unused))
