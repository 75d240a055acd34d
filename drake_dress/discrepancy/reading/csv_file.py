"""Reads measured logs in CSV: a column for each number, marker rest places in a second file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from drake_dress.discrepancy.reading.csv_table import column, numbers, read_table
from drake_dress.discrepancy.reading.labels import label_of, order_of
from drake_dress.discrepancy.reading.raw import (
    JOINTS,
    MARKERS,
    PLACES,
    RawRecording,
    misspelt,
    unused_note,
)
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.sides import SIDES
from drake_dress.report.log_schema import JOINT_NAMES

_VECTORS = [f"gripper/{side}/{q}" for side in SIDES for q in ("position", "force")]


def read_csv(path: Path) -> list[RawRecording]:
    """Returns the single recording of a CSV file.

    Raises:
        UserError: the file, or the one with the markers' rest places, cannot be used.
    """
    source = str(path)
    header, rows, lines = read_table(path)
    used: set[str] = set()
    arrays: dict[str, npt.NDArray[Any]] = {}
    labels: dict[str, tuple[str, ...]] = {}

    def take(names: list[str]) -> FloatArray:
        used.update(names)
        there = [header.index(n) for n in names if n in header]
        found = numbers(source, header, rows, lines, there)
        for name in names:
            column(source, header, name)
        return found

    if "time" in header:
        arrays["time"] = take(["time"])[:, 0]
    for name in _VECTORS:
        columns = [f"{name}/{axis}" for axis in "xyz"]
        if any(c in header for c in columns):
            arrays[name] = take(columns)
    for name in (MARKERS, JOINTS):
        points = _points(source, name, header)
        if points:
            columns = [f"{name}/{written}/{axis}" for written in points.values() for axis in "xyz"]
            arrays[name] = take(columns).reshape(len(rows), len(points), 3)
            labels[name] = tuple(points)
    # a joint's number is its index in the layout
    joints = labels.get(JOINTS)
    if joints and all(label.isdigit() for label in joints):
        order = order_of(source, [str(k) for k in range(len(JOINT_NAMES))], joints, "joint")
        labels[JOINTS] = JOINT_NAMES
        arrays[JOINTS] = arrays[JOINTS][:, order]
    if MARKERS in arrays:
        arrays[PLACES] = _places(path.with_suffix(".markers.csv"), labels[MARKERS])
    unused = [h for h in header if h and h not in used]
    stems = tuple(dict.fromkeys(h.rsplit("/", 1)[0] if "/" in h else h for h in unused))
    return [RawRecording(source, "", "", arrays, {}, labels, stems, tuple(unused_note(unused)))]


def _points(source: str, name: str, header: list[str]) -> dict[str, str]:
    """Returns the labels of a dataset's points, numbers sorted, and the spelling of each."""
    depth = name.count("/") + 1
    points: dict[str, str] = {}
    for h in header:
        parts = h.split("/")
        if len(parts) != depth + 2 or not h.startswith(f"{name}/") or parts[-1] not in "xyz":
            continue
        written = parts[depth]
        label = label_of(written)
        if points.setdefault(label, written) != written:
            raise UserError(
                source, h, f"is point {label} as is {points[label]!r}, expected it once"
            )
    if all(label.isdigit() for label in points):
        points = dict(sorted(points.items(), key=lambda p: int(p[0])))
    return points


def _places(path: Path, wanted: tuple[str, ...]) -> FloatArray:
    """Returns (m,3) the markers' rest places, in the order of the wanted labels, m."""
    source = str(path)
    if not path.is_file():
        raise UserError(source, "", "no such file, expected columns marker, x, y, z")
    header, rows, lines = read_table(path)
    for name in ("marker", "x", "y", "z"):
        if name not in header:
            near = misspelt(name, header)
            hint = f"; is {near} meant?" if near else f", found {', '.join(header)[:60]}"
            raise UserError(source, name, f"column is missing{hint}")
    axes = [header.index(axis) for axis in "xyz"]
    given = [label_of(row[header.index("marker")]) for row in rows]
    places = numbers(source, header, rows, lines, axes)
    order = order_of(source, wanted, given)
    for label, i in zip(wanted, order, strict=True):
        if not np.isfinite(places[i]).all():
            raise UserError(source, f"marker {label}", "has no place, expected finite x, y, z")
    return places[order]
