"""One recording as it stands in a file, before anything is believed of it."""

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
# What is read, and the unit that it is in.
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
# How each unit may be spelt.
_SPELT = {
    "s": {"s", "sec", "second", "seconds"},
    "m": {"m", "meter", "meters", "metre", "metres"},
    "N": {"N", "newton", "newtons", "Newton", "Newtons"},
    "": {"", "1"},
}
# A dataset is not larger than this, bytes: 600 s of 400 markers at 100 Hz are 0.6 GB.
MOST_BYTES = 2**30


@dataclass(frozen=True)
class RawRecording:
    """Datasets by the names of `UNITS`, of any shape and any numbers.

    Attributes:
        source: the file.
        group: that the recording stands in; empty for the file's root.
        title: what it is called; may be empty.
        arrays: dataset by name.
        noise: of datasets whose noise is given, m or N.
        labels: what tells the points of a dataset apart, in their order, where that is given.
        names: of all that the file holds for this recording, to find misspelt ones.
        notes: what was not used or was read otherwise than it stands.
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
        """Returns how a dataset is called in messages."""
        return f"{self.group}/{dataset}" if self.group else dataset

    def missing(self, dataset: str, message: str = "is missing") -> UserError:
        """Returns the error that a dataset is missing, with what may have been meant."""
        near = misspelt(dataset, [n for n in self.names if n not in UNITS])
        hint = f"; is {near} meant?" if near else ""
        return UserError(self.source, self.key(dataset), message + hint)


def misspelt(name: str, found: Sequence[str]) -> str | None:
    """Returns which of the names found may stand for `name`; None where none is like it."""
    for other in found:
        low = other.lower()
        if low.startswith(name) or low.endswith(name) or name.endswith(f"/{low}"):
            return other
    near = difflib.get_close_matches(name, found, n=1, cutoff=0.8)
    return near[0] if near else None


def recording_groups(names: Iterable[str]) -> list[str]:
    """Returns the prefixes of the recordings among dataset names, `recording_2` before `_10`.

    A file without any holds one recording at its root: the prefix is empty.
    """
    found = {n.split("/")[0] for n in names if n.startswith("recording_") and "/" in n}

    def order(group: str) -> tuple[list[tuple[bool, int, str]], str]:
        parts = re.split(r"(\d+)", group)
        return [(p.isdigit(), int(p) if p.isdigit() else 0, p) for p in parts], group

    return [f"{g}/" for g in sorted(found, key=order)] or [""]


def check_unit(source: str, key: str, dataset: str, unit: str) -> None:
    """Raises UserError where a dataset's unit, as the file gives it, is not the one expected."""
    expected = UNITS[dataset]
    if unit.strip() not in _SPELT[expected]:
        raise UserError(source, key, f"is in {unit!r}, expected {expected or 'no unit'}")


def check_content(source: str, key: str, kind: np.dtype[Any], shape: tuple[int, ...]) -> None:
    """Raises UserError where a dataset is not numbers, or is too large to be a recording."""
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
    """Returns the standard deviation that a file gives, and a note where it gives several.

    Raises:
        UserError: it is not a number above 0, or not numbers that all are.
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
    """Returns the note that says which names of a file are not used; none where all are."""
    if not names:
        return []
    shown, more = list(names[:12]), len(names) - 12
    return [f"not used: {', '.join(shown)}" + (f" and {more} more" if more > 0 else "")]


def _short(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 40 else text[:37] + "..."
