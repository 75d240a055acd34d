"""Turns a file's content into a recording: shapes, clock, plausibility, noise, lost markers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drake_dress.discrepancy.marker_faults import without_faults, without_substitutes
from drake_dress.discrepancy.reading.clock import checked_time
from drake_dress.discrepancy.reading.labels import check_unique, order_of
from drake_dress.discrepancy.reading.noise import noise_of
from drake_dress.discrepancy.reading.plausibility import (
    check_grippers,
    check_joints,
    check_markers,
    check_places,
)
from drake_dress.discrepancy.reading.raw import (
    JOINTS,
    MARKER_NAMES,
    MARKERS,
    NODES,
    PLACES,
    RawRecording,
)
from drake_dress.discrepancy.reading.weight import check_forces
from drake_dress.discrepancy.recording import Recording
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.geodesic_reach import reach_between
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES
from drake_dress.report.log_schema import JOINT_NAMES

# Fewest and most markers: fewer carry too little information, and each one costs time in every step
# of every simulation.
_LEAST_MARKERS, _MOST_MARKERS = 4, 1000
# No measured value exceeds this in any unit; time since an epoch in nanoseconds is 2e18.
_WILDEST = 1e20
_FORCES = tuple(f"gripper/{side}/force" for side in SIDES)


def recording_of(raw: RawRecording, mesh: GarmentMesh, surface_density: float | None) -> Recording:
    """Returns the recording in SI units; its notes say what was dropped or changed.

    Args:
        raw: content of a file.
        mesh: the scenario's garment.
        surface_density: of its fabric, kg/m²; None allows any.

    Raises:
        UserError: a dataset is missing, has the wrong shape, or is implausible.
    """
    notes = list(raw.notes)
    time, said = checked_time(raw.source, raw.key("time"), _taken(raw, "time", (None,)))
    notes += said
    count = len(time)
    gripper = np.stack(
        [_taken(raw, f"gripper/{side}/position", (count, 3)) for side in SIDES], axis=1
    )
    marker = _taken(raw, MARKERS, (count, None, 3), gaps=True)
    number = marker.shape[1]
    if not _LEAST_MARKERS <= number <= _MOST_MARKERS:
        raise UserError(
            raw.source,
            raw.key(MARKERS),
            f"has {number} markers, expected {_LEAST_MARKERS} or more, up to {_MOST_MARKERS}",
        )
    places = _places(raw, number, mesh)
    names = _marker_names(raw, number)
    marker, said = without_substitutes(time, marker, gripper, names)
    notes += said
    _check_seen(raw, marker)
    start = check_markers(raw, time, marker, places)
    check_grippers(raw, time, gripper, start, mesh)
    force, said = _force(raw, count)
    notes += said
    if force is not None:
        check_forces(raw, time, force, mesh, surface_density)
    joints = _joints(raw, count)
    if joints is not None:
        check_joints(raw, time, joints)
    marker_noise, said = noise_of(raw, (MARKERS,), marker)
    notes += said
    reach = reach_between(mesh, places)
    marker, said = without_faults(time, marker, places, reach, marker_noise, names)
    notes += said
    _check_seen(raw, marker)
    force_noise, said = noise_of(raw, _FORCES, force)
    notes += said
    return Recording(
        raw.group or raw.source.rsplit("/", 1)[-1].rsplit(".", 1)[0],
        time,
        gripper,
        marker,
        places,
        force,
        joints,
        marker_noise,
        force_noise,
        tuple(notes),
    )


def _taken(
    raw: RawRecording, dataset: str, shape: tuple[int | None, ...], gaps: bool = False
) -> FloatArray:
    """Returns a dataset as numbers with the given shape; `gaps` allows NaN.

    Raises:
        UserError: it is missing, has another shape, or holds values that are not finite.
    """
    if dataset not in raw.arrays:
        raise raw.missing(dataset)
    key, given = raw.key(dataset), raw.arrays[dataset]
    if given.dtype.kind not in "fiu":
        raise UserError(raw.source, key, "does not hold numbers")
    value = given.astype(np.float64)
    fits = len(value.shape) == len(shape) and all(
        want is None or want == got for want, got in zip(shape, value.shape, strict=True)
    )
    if not fits:
        wanted = ", ".join("any" if s is None else str(s) for s in shape)
        raise UserError(raw.source, key, f"has shape {value.shape}, expected ({wanted})")
    bad = np.isinf(value) if gaps else ~np.isfinite(value)
    # infinity may encode a lost marker
    if bad.any() and dataset != MARKERS:
        where = tuple(int(i) for i in np.argwhere(bad)[0])
        raise UserError(raw.source, key, f"is {value[where]} at {where}, expected finite numbers")
    # a corrupted number, whose square may overflow
    wild = np.abs(value) > _WILDEST
    if wild.any() and dataset != MARKERS:
        where = tuple(int(i) for i in np.argwhere(wild)[0])
        raise UserError(raw.source, key, f"is {value[where]:.3g} at {where}, expected SI units")
    return value


def _places(raw: RawRecording, number: int, mesh: GarmentMesh) -> FloatArray:
    """Returns (m,3) the markers' positions on the rest shape, in the order of the markers, m."""
    if PLACES in raw.arrays:
        dataset, places = PLACES, _taken(raw, PLACES, (number, 3))
    elif NODES in raw.arrays:
        dataset, places = NODES, _at_nodes(raw, number, mesh)
    else:
        raise raw.missing(PLACES, "is missing, expected it or garment/marker_node")
    key = raw.key(dataset)
    names, given = _marker_names(raw, number, ""), raw.labels.get(dataset, ())
    if given:
        check_unique(raw.source, key, given, number)
    if given and names:
        places = places[order_of(raw.source, names, given)]
    check_places(raw, key, places, mesh)
    return places


def _at_nodes(raw: RawRecording, number: int, mesh: GarmentMesh) -> FloatArray:
    """Returns (m,3) the rest positions of markers that are given as nodes, m."""
    key, given = raw.key(NODES), _taken(raw, NODES, (number,))
    points = mesh.rest_position
    if "garment/rest_position" in raw.arrays:
        points = _taken(raw, "garment/rest_position", (None, 3))
    fraction = given != np.rint(given)
    wrong = fraction | (given < 0) | (given >= len(points))
    if wrong.any():
        raise UserError(
            raw.source,
            key,
            f"holds {given[np.argmax(wrong)]:g}, expected whole numbers of nodes from 0 to "
            f"{len(points) - 1}",
        )
    nodes, times = np.unique(given.astype(int), return_counts=True)
    if times.max() > 1:
        twice = nodes[np.argmax(times)]
        raise UserError(raw.source, key, f"holds node {twice} twice, expected each node once")
    return points[given.astype(int)]


def _marker_names(raw: RawRecording, number: int, otherwise: str = "{}") -> tuple[str, ...]:
    """Returns the markers' names, by default made from `otherwise` and their numbers."""
    for dataset in (MARKERS, MARKER_NAMES):
        names = raw.labels.get(dataset, ())
        if names:
            check_unique(raw.source, raw.key(dataset), names, number)
            return names
    return tuple(otherwise.format(k) for k in range(number)) if otherwise else ()


def _force(raw: RawRecording, count: int) -> tuple[FloatArray | None, list[str]]:
    """Returns (T,2,3) forces, N, if both grippers have them, and a note if only one has."""
    there = [name for name in _FORCES if name in raw.arrays]
    if len(there) == 1:
        (lacks,) = set(_FORCES) - set(there)
        lack = raw.missing(lacks)
        return None, [f"not used: {raw.key(there[0])}, since {lack.key} {lack.message}"]
    if not there:
        return None, []
    force = np.stack([_taken(raw, name, (count, 3), gaps=True) for name in _FORCES], axis=1)
    if np.isfinite(force).all(axis=(2,)).any(axis=0).all():
        return force, []
    return None, [f"not used: {raw.key('gripper/*/force')}, which holds no number of one gripper"]


def _joints(raw: RawRecording, count: int) -> FloatArray | None:
    """Returns (T,6,3) the person's joints, ordered as `JOINT_NAMES`, m; None if not measured."""
    if JOINTS not in raw.arrays:
        return None
    joints = _taken(raw, JOINTS, (count, len(JOINT_NAMES), 3))
    given = raw.labels.get(JOINTS, ())
    if not given:
        return joints
    key = raw.key(JOINTS)
    check_unique(raw.source, key, given, len(JOINT_NAMES))
    unknown = [name for name in given if name not in JOINT_NAMES]
    if unknown:
        raise UserError(raw.source, key, f"names {unknown[0]!r}, expected {', '.join(JOINT_NAMES)}")
    return joints[:, [given.index(name) for name in JOINT_NAMES]]


def _check_seen(raw: RawRecording, marker: FloatArray) -> None:
    """Raises UserError if too few markers (T,m,3) are ever seen."""
    ever = int(np.isfinite(marker).all(axis=2).any(axis=0).sum())
    if ever < _LEAST_MARKERS:
        raise UserError(
            raw.source,
            raw.key(MARKERS),
            f"{ever} markers are ever seen, expected {_LEAST_MARKERS} or more",
        )


def all_notes(recordings: Sequence[Recording]) -> list[str]:
    """Returns the notes of all recordings, each with its recording's name, without repetitions."""
    lines = [f"{r.name}: {note}" for r in recordings for note in r.notes]
    return list(dict.fromkeys(lines))
