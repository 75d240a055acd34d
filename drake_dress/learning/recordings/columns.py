"""Finds time and joints in the columns of a table by their names."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray

_SIDES = {"left": 0, "l": 0, "right": 1, "r": 1}
_JOINTS = {
    "shoulder": 0,
    "sho": 0,
    "sh": 0,
    "elbow": 1,
    "elb": 1,
    "el": 1,
    "wrist": 2,
    "wri": 2,
    "wr": 2,
    "hand": 2,
}
# A hand's middle is preferred where a file has wrist and hand: the rows are those of hands.
_PREFERRED = ("hand", "wrist")
_AXES = {"x": 0, "y": 1, "z": 2}
_TIMES = {"time": 1.0, "t": 1.0, "timestamp": 1.0, "seconds": 1.0, "sec": 1.0, "s": 1.0}
_MILLISECONDS = {"ms", "msec", "millis", "milliseconds"}
_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")


@dataclass(frozen=True)
class Columns:
    """Columns of a table.

    Attributes:
        points: column of each (joint 0 to 5, axis 0 to 2).
        time: column of time; None if there is none.
        time_unit: of that column, s.
    """

    points: dict[tuple[int, int], int]
    time: int | None
    time_unit: float


def read_table(path: Path) -> tuple[list[str], FloatArray]:
    """Returns header and rows of a text file with commas, semicolons, tabs or spaces.

    Empty cells and words such as `nan` become NaN.

    Raises:
        UserError: it is no such table.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(str(path), "", "cannot be read as text") from error
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if len(lines) < 2:
        raise UserError(str(path), "", "is empty, expected a header and rows of numbers")
    delimiter = next((d for d in (",", ";", "\t") if d in lines[0]), " ")
    rows = list(csv.reader(lines, delimiter=delimiter, skipinitialspace=True))
    header = [cell.strip() for cell in rows[0]]
    numbers = np.full((len(rows) - 1, len(header)), np.nan)
    for k, row in enumerate(rows[1:]):
        cells = [cell for cell in row if cell.strip()] if delimiter == " " else row
        if len(cells) > len(header):
            raise UserError(
                str(path), f"row {k + 2}", f"has {len(cells)} cells, expected {len(header)}"
            )
        for column, cell in enumerate(cells):
            numbers[k, column] = _number(path, k + 2, header[column], cell)
    return header, numbers


def columns_of(path: Path, header: Sequence[str]) -> Columns:
    """Returns the columns that a header names.

    Raises:
        UserError: no arm is named in full.
    """
    time, time_unit = None, 1.0
    found: dict[tuple[int, int], tuple[str, int]] = {}
    for column, name in enumerate(header):
        words = [w.lower() for w in _WORDS.findall(name)]
        words = _split(words)
        if words and words[0] in _TIMES and time is None:
            time = column
            time_unit = 1e-3 if _MILLISECONDS & set(words) else 1.0
            continue
        side = next((_SIDES[w] for w in words if w in _SIDES), None)
        joint = next((w for w in words if w in _JOINTS), None)
        axis = _AXES.get(words[-1]) if words else None
        if side is None or joint is None or axis is None:
            continue
        key = (3 * side + _JOINTS[joint], axis)
        before = found.get(key)
        if before is None or _rank(joint) < _rank(before[0]):
            found[key] = joint, column
    points = {key: column for key, (_, column) in found.items()}
    if not any(
        all((3 * arm + joint, axis) in points for joint in range(3) for axis in range(3))
        for arm in (0, 1)
    ):
        raise UserError(
            str(path),
            "header",
            "names no arm in full, expected columns such as left_shoulder_x, left_elbow_x, "
            f"left_hand_x with y and z; found {', '.join(header[:8])}…",
        )
    return Columns(points, time, time_unit)


def _rank(joint: str) -> int:
    return _PREFERRED.index(joint) if joint in _PREFERRED else len(_PREFERRED)


def _split(words: Sequence[str]) -> list[str]:
    """Returns words in which a side that stands before a joint is a word of its own: rwrist."""
    result: list[str] = []
    for word in words:
        side = word[:1] if word[:1] in ("l", "r") and word[1:] in _JOINTS else None
        result += [word] if side is None else [side, word[1:]]
    return result


def _number(path: Path, row: int, name: str, cell: str) -> float:
    text = cell.strip()
    if not text or text.lower() in ("nan", "na", "none", "null", "-"):
        return float("nan")
    try:
        return float(text)
    except ValueError:
        raise UserError(
            str(path), f"row {row}, {name}", f"is {text!r}, expected a number"
        ) from None
