"""One recording as read from a file, before any check of its content."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from drake_dress.errors import UserError
from drake_dress.models.sides import SIDES

Array = npt.NDArray[Any]

MARKERS, PLACES, NODES = (
    "garment/marker_position",
    "garment/marker_rest_position",
    "garment/marker_node",
)
MARKER_NAMES = "garment/marker_name"
JOINTS = "human/joint_position"
# Datasets that are read, and their units.
UNITS: dict[str, str] = {
    "time": "s",
    **{f"gripper/{side}/position": "m" for side in SIDES},
    **{f"gripper/{side}/force": "N" for side in SIDES},
    MARKERS: "m",
    PLACES: "m",
    NODES: "",
    "garment/rest_position": "m",
    JOINTS: "m",
}
# Accepted spellings of each unit.
_SPELT = {
    "s": {"s", "sec", "second", "seconds"},
    "m": {"m", "meter", "meters", "metre", "metres"},
    "N": {"N", "newton", "newtons", "Newton", "Newtons"},
    "": {"", "1"},
}
# Largest dataset, bytes: 600 s of 400 markers at 100 Hz are 0.6 GB.
MOST_BYTES = 2**30


@dataclass(frozen=True)
class RawRecording:
    """Datasets by the names of `UNITS`, of any shape and with any values.

    Attributes:
        source: the file.
        group: group of the recording; empty for the file's root.
        title: name of the recording; may be empty.
        arrays: datasets by name.
        noise: standard deviation of the noise by dataset, where it is given, m or N.
        labels: labels of the points by dataset, in their order, where they are given.
        names: all names that the file holds for this recording, to find misspelled ones.
        notes: what was not used, or was changed when it was read.
    """

    source: str
    group: str
    title: str
    arrays: Mapping[str, Array]
    noise: Mapping[str, float]
    labels: Mapping[str, tuple[str, ...]]
    names: tuple[str, ...]
    notes: tuple[str, ...] = ()

    def key(self, dataset: str) -> str:
        """Returns the name of a dataset in messages."""
        return f"{self.group}/{dataset}" if self.group else dataset

    def missing(self, dataset: str, message: str = "is missing") -> UserError:
        """Returns the error that a dataset is missing; it suggests a similar name, if any."""
        near = misspelt(dataset, [n for n in self.names if n not in UNITS])
        hint = f"; is {near} meant?" if near else ""
        return UserError(self.source, self.key(dataset), message + hint)


def misspelt(name: str, found: Sequence[str]) -> str | None:
    """Returns the found name that may be a misspelled `name`, or None."""
    for other in found:
        low = other.lower()
        if low.startswith(name) or low.endswith(name) or name.endswith(f"/{low}"):
            return other
    near = difflib.get_close_matches(name, found, n=1, cutoff=0.8)
    return near[0] if near else None


def recording_groups(names: Iterable[str]) -> list[str]:
    """Returns the prefixes of the recordings among dataset names, `recording_2` before `_10`.

    A file without such groups holds one recording at its root, with an empty prefix.
    """
    found = {n.split("/")[0] for n in names if n.startswith("recording_") and "/" in n}

    def order(group: str) -> tuple[list[tuple[bool, int, str]], str]:
        parts = re.split(r"(\d+)", group)
        return [(p.isdigit(), int(p) if p.isdigit() else 0, p) for p in parts], group

    return [f"{g}/" for g in sorted(found, key=order)] or [""]


def check_unit(source: str, key: str, dataset: str, unit: str) -> None:
    """Raises UserError if the unit that a file gives for a dataset is not the expected one."""
    expected = UNITS[dataset]
    if unit.strip() not in _SPELT[expected]:
        raise UserError(source, key, f"is in {unit!r}, expected {expected or 'no unit'}")


def check_content(source: str, key: str, kind: np.dtype[Any], shape: tuple[int, ...]) -> None:
    """Raises UserError if a dataset does not hold numbers, or is too large for a recording."""
    if kind.kind not in "fiu":
        raise UserError(source, key, f"does not hold numbers but {kind}, expected numbers")
    size = kind.itemsize
    for count in shape:
        size *= int(count)
    if size > MOST_BYTES:
        raise UserError(
            source,
            key,
            f"has shape {shape}, {size / 2**30:.3g} GB, expected up to {MOST_BYTES / 2**30:g} GB",
        )


def noise_std(source: str, key: str, value: Any) -> tuple[float, str | None]:
    """Returns the standard deviation that a file gives; of several the largest, with a note.

    Raises:
        UserError: a value is not a number above 0.
    """
    try:
        given = np.asarray(value)
        numbers = given.astype(np.float64) if given.dtype.kind in "fiu" else None
    except (TypeError, ValueError):
        numbers = None
    if numbers is None or numbers.size == 0:
        raise UserError(source, key, f"has noise_std {_short(value)}, expected a number above 0")
    if not np.all(np.isfinite(numbers) & (numbers > 0.0)):
        bad = numbers[~(np.isfinite(numbers) & (numbers > 0.0))].flat[0]
        raise UserError(source, key, f"has noise_std {bad:g}, expected a number above 0")
    largest = float(numbers.max())
    if numbers.size == 1 or numbers.min() == largest:
        return largest, None
    return largest, f"{key}: of {numbers.size} values of noise_std the largest, {largest:g}, counts"


def unused_note(names: Sequence[str]) -> list[str]:
    """Returns a note that lists the unused names of a file; empty if all are used."""
    if not names:
        return []
    shown, more = list(names[:12]), len(names) - 12
    return [f"not used: {', '.join(shown)}" + (f" and {more} more" if more > 0 else "")]


def _short(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 40 else text[:37] + "..."
