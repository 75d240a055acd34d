"""Reads measured logs in HDF5, in the layout of `run.h5`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from drake_dress.discrepancy.reading.raw import (
    MARKER_NAMES,
    UNITS,
    RawRecording,
    check_content,
    check_unit,
    noise_std,
    recording_groups,
    unused_note,
)
from drake_dress.errors import UserError
from drake_dress.hdf5_state import Hdf5State, look_at

# Errors that h5py raises on damaged files: the library's, and Python's when it decodes content.
_DAMAGED = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError, OverflowError)
# Largest number of names in a file.
_MOST_NAMES = 20_000
# Attributes that name the points of a dataset.
_NAMES = ("names", "marker_name", "labels")
_FRAMES = {"garment/marker_rest_position": "garment", "garment/rest_position": "garment"}


def read_hdf5(path: Path) -> list[RawRecording]:
    """Returns the recordings of an HDF5 file.

    Raises:
        UserError: the file or one of its datasets cannot be read.
    """
    source = str(path)
    _check_state(path)
    with _guarded(source, "", "is not a readable HDF5 file"):
        file = h5py.File(path, "r")
    with file:
        with _guarded(source, "", "is not a readable HDF5 file"):
            content = dict(_content(source, file))
        return [_recording(source, file, content, group) for group in recording_groups(content)]


def _check_state(path: Path) -> None:
    """Raises UserError if a file is damaged, or is being written."""
    with _guarded(str(path), "", "cannot be read"):
        found = look_at(path)
    if found.state not in (Hdf5State.SOUND, Hdf5State.KILLED):
        raise UserError(str(path), "", f"{found.message}, expected a measured log in HDF5")


def _content(source: str, file: h5py.File) -> Iterator[tuple[str, h5py.Dataset | None]]:
    """Yields each dataset by its path; None for a link that leads nowhere."""
    seen, entered = 0, {_identity(file)}
    waiting: list[tuple[str, h5py.Group]] = [("", file)]
    while waiting:
        prefix, group = waiting.pop(0)
        for name in sorted(group):
            seen += 1
            if seen > _MOST_NAMES:
                raise UserError(source, "", f"holds more than {_MOST_NAMES} names")
            try:
                found = group[name]
            except (KeyError, OSError):
                yield prefix + name, None
                continue
            if isinstance(found, h5py.Group):
                if prefix + name in UNITS:
                    raise UserError(source, prefix + name, "is a group, expected a dataset")
                if _identity(found) not in entered:
                    entered.add(_identity(found))
                    waiting.append((f"{prefix}{name}/", found))
            elif isinstance(found, h5py.Dataset):
                yield prefix + name, found


def _recording(
    source: str, file: h5py.File, content: dict[str, h5py.Dataset | None], group: str
) -> RawRecording:
    arrays, noise, notes = {}, {}, []
    labels: dict[str, tuple[str, ...]] = {}
    used = set()
    for name in (*UNITS, MARKER_NAMES):
        key = _key_of(source, file, content, group, name)
        if key is None:
            continue
        data = content[key]
        if data is None:
            raise UserError(source, key, "is a link that leads nowhere, expected a dataset")
        used.add(key)
        if name == MARKER_NAMES:
            labels[name] = _texts(source, key, data)
            continue
        arrays[name] = _read(source, key, data)
        attributes = _attributes(source, key, data)
        _check_meaning(source, key, name, attributes)
        if "noise_std" in attributes:
            noise[name], note = noise_std(source, key, attributes["noise_std"])
            notes += [note] if note else []
        for attribute in _NAMES:
            if attribute in attributes:
                labels[name] = _texts(source, f"{key}: {attribute}", attributes[attribute])
    mine = [k for k in content if k.startswith(group)] if group else list(content)
    others = [k for k in content if not k.startswith("recording_")] if group else []
    unused = [k for k in dict.fromkeys(mine + others) if k not in used]
    motion = _attributes(source, group.rstrip("/"), file[group or "/"]).get("motion", "")
    title = motion if isinstance(motion, str) and len(motion.split()) == 1 else ""
    names = tuple(k[len(group) :] if k.startswith(group) else k for k in dict.fromkeys(mine))
    return RawRecording(
        source,
        group.rstrip("/"),
        title,
        arrays,
        noise,
        labels,
        (*names, *others),
        (*notes, *unused_note(unused)),
    )


def _key_of(
    source: str,
    file: h5py.File,
    content: dict[str, h5py.Dataset | None],
    group: str,
    name: str,
) -> str | None:
    """Returns the path of a recording's dataset; None if there is none."""
    # datasets that recordings share may be stored once, at the root
    key = next((k for k in (group + name, name) if k in content), None)
    if key is not None:
        return key
    near = next((k for k in content if (group + name).startswith(k + "/")), None)
    if near is not None and content[near] is None:
        raise UserError(source, near, "is a link that leads nowhere, expected a group")
    if group and isinstance(file.get(group + name), h5py.Group):
        raise UserError(source, group + name, "is a group, expected a dataset")
    return None


def _check_meaning(source: str, key: str, name: str, attributes: dict[str, Any]) -> None:
    """Raises UserError if a dataset has another unit or frame than the layout."""
    for unit in ("unit", "units"):
        if unit in attributes:
            check_unit(source, key, name, _text(attributes[unit]))
    frame = _text(attributes.get("frame", "")).strip().lower()
    expected = _FRAMES.get(name, "world")
    if frame not in ("", expected, expected[0]):
        raise UserError(source, key, f"is in the frame {frame!r}, expected {expected}")


def _read(source: str, key: str, data: h5py.Dataset) -> np.ndarray:
    with _guarded(source, key, "cannot be read"):
        if data.shape is None:
            raise UserError(source, key, "holds nothing, expected numbers")
        check_content(source, key, data.dtype, data.shape)
        plan = data.id.get_create_plist()
        filters = [plan.get_filter(k) for k in range(plan.get_nfilters())]
        for number, _, _, name in filters:
            if not h5py.h5z.filter_avail(number):
                called = name.decode("ascii", "replace") or "unknown"
                raise UserError(
                    source,
                    key,
                    f"is compressed by a filter that is not installed ({called}, number {number}), "
                    "expected gzip, lzf or none",
                )
        return np.asarray(data[()])


def _identity(group: h5py.Group) -> tuple[int, int]:
    """Returns an identity of a group, whatever its name; links between groups may form cycles."""
    info = h5py.h5o.get_info(group.id)
    return info.fileno, info.addr


def _attributes(source: str, key: str, data: h5py.HLObject) -> dict[str, Any]:
    """Returns the attributes that are used here."""
    with _guarded(source, key, "has attributes that cannot be read"):
        wanted = ("unit", "units", "frame", "noise_std", "motion", *_NAMES)
        return {name: data.attrs[name] for name in wanted if name in data.attrs}


def _texts(source: str, key: str, value: Any) -> tuple[str, ...]:
    """Returns the names of points from an attribute or a dataset of strings or integers."""
    with _guarded(source, key, "cannot be read"):
        entries = np.atleast_1d(np.asarray(value[()] if isinstance(value, h5py.Dataset) else value))
        if entries.ndim != 1 or entries.dtype.kind not in "OSUiu":
            raise UserError(source, key, "does not hold names, expected a text for each point")
        return tuple(_text(entry) for entry in entries)


def _text(value: Any) -> str:
    """Returns an attribute as text; other types as Python prints them."""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.flat[0]
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return str(value)


@contextmanager
def _guarded(source: str, key: str, message: str) -> Iterator[None]:
    """Turns errors of damaged files into a UserError of one line."""
    try:
        yield
    except UserError:
        raise
    except _DAMAGED as error:
        reason = str(error) or type(error).__name__
        raise UserError(source, key, f"{message}: {reason}") from error
