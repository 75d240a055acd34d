"""Finds where, when and in which signal the residual exceeds noise most."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drake_dress.discrepancy.lab import PersonShape
from drake_dress.discrepancy.recording import Recording
from drake_dress.discrepancy.whitening import Whitening
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray
from drake_dress.models.cloth.contact.distance import nearest_obstacle
from drake_dress.models.garment.mesh import REGION_NAMES, GarmentMesh

# Gripper speeds below which a phase is at rest, and from which it is fast, m/s.
_STILL, _FAST = 0.01, 0.15
# Largest distance from a limb's surface at which a marker counts as lying on it, m.
_ON_LIMB = 0.02
KINDS = ("signal", "recording", "region", "limb", "phase", "time", "marker")


@dataclass(frozen=True)
class Spot:
    """A part of the data and its residual.

    Attributes:
        kind: one of `KINDS`.
        name: name of the part.
        rms: RMS of the residual, m or N.
        noise: RMS of the sensors' noise, likewise.
        whitened: mean squared whitened residual; 1 if there is only noise.
    """

    kind: str
    name: str
    rms: float
    noise: float
    whitened: float


def spots(
    whitening: Whitening,
    predicted: FloatArray,
    recordings: Sequence[Recording],
    mesh: GarmentMesh,
    contact: Sequence[FloatArray],
    samples: Sequence[IndexArray],
    person: PersonShape,
) -> list[Spot]:
    """Returns all parts, worst first.

    Args:
        whitening: whitening of the data.
        predicted: (N,) whitened prediction of the simulation.
        recordings: measured recordings.
        mesh: mesh that carries the markers.
        contact: share of nodes in contact at each compared sample of each recording.
        samples: indices of the compared samples of each recording.
        person: person whose limbs the garment touches.
    """
    w = whitening
    squared = (w.data - predicted) ** 2
    size = w.size(w.data - predicted)
    found: list[Spot] = []
    for part in _parts(w, recordings, mesh, contact, samples, person):
        rows = part.rows
        if not rows.any():
            continue
        dimensions = 1 if w.is_force[rows].all() else 3
        found.append(
            Spot(
                part.kind,
                part.name,
                float(np.sqrt(dimensions * np.mean(size[rows] ** 2))),
                float(np.sqrt(dimensions * np.mean(w.sensor[rows] ** 2))),
                float(np.mean(squared[rows])),
            )
        )
    return sorted(found, key=lambda s: -s.whitened)


def worst(found: Sequence[Spot], most: int = 3) -> list[Spot]:
    """Returns the first `most` spots of each kind, in the order of `KINDS`.

    Args:
        found: spots, worst first.
        most: number of spots of a kind, at most.
    """
    return [s for kind in KINDS for s in [s for s in found if s.kind == kind][:most]]


def limbs_touched(recording: Recording, samples: IndexArray, person: PersonShape) -> IndexArray:
    """Returns (S,m) the index in `person.LIMB_NAMES` of the limb that each marker lies on, or −1.

    Args:
        recording: markers, and joints that place the limbs if they were measured.
        samples: (S,) indices of samples.
        person: sizes of the person, and the pose if joints were not measured.
    """
    joints = recording.joint_position
    markers = recording.marker_position.shape[1]
    found = np.full((len(samples), markers), -1, dtype=np.int64)
    distance, owner = np.empty(markers), np.empty(markers, dtype=np.int32)
    still = np.zeros((6, 3))
    bodies = person.obstacles(person.posed, still)
    for row, sample in zip(found, samples, strict=True):
        if joints is not None:
            bodies = person.obstacles(joints[sample], still)
        seen = np.ascontiguousarray(recording.marker_position[sample])
        nearest_obstacle(seen, bodies.packed, distance, owner)
        on = np.isfinite(seen).all(axis=1) & (distance < _ON_LIMB)
        row[on] = person.limb[owner[on]]
    return found


class _Part(NamedTuple):
    """A part of the data: its kind, its name, and the mask of its values among all N."""

    kind: str
    name: str
    rows: BoolArray


def _parts(
    w: Whitening,
    recordings: Sequence[Recording],
    mesh: GarmentMesh,
    contact: Sequence[FloatArray],
    samples: Sequence[IndexArray],
    person: PersonShape,
) -> Iterator[_Part]:
    """Yields all parts, lazily since there are many; arguments as in `spots`."""
    markers = ~w.is_force
    yield _Part("signal", "markers", markers)
    for k, side in enumerate(("left", "right")):
        yield _Part("signal", f"force of the {side} gripper", w.is_force & (w.marker == k))
    for i, r in enumerate(recordings):
        rows = (w.recording == i) & markers
        yield _Part("recording", r.name, rows)
        yield from _places(w, rows, r, mesh)
        # index in `samples` of each marker value
        at = np.searchsorted(r.time[samples[i]] - r.time[0], w.time[rows] - 1e-9)
        at = np.minimum(at, len(samples[i]) - 1)
        limb = limbs_touched(r, samples[i], person)
        yield from _limbs(r, rows, limb[at, w.marker[rows]], person)
        yield from _phases(r, rows, _phase(r, samples[i])[at], (contact[i] > 0.0)[at])
        yield from _seconds(w, rows, r)


def _places(
    w: Whitening, markers: BoolArray, recording: Recording, mesh: GarmentMesh
) -> Iterator[_Part]:
    """Yields the regions of the garment and the single markers.

    Args:
        w: whitening of the data.
        markers: (N,) mask of the recording's marker values.
        recording: the recording.
        mesh: mesh that carries the markers.
    """
    r = recording
    region = _regions(mesh, r.marker_rest_position)
    for number, name in enumerate(REGION_NAMES):
        rows = markers & np.isin(w.marker, np.flatnonzero(region == number))
        yield _Part("region", f"{name.replace('_', ' ')} in {r.name}", rows)
    for k in range(r.marker_position.shape[1]):
        where = REGION_NAMES[region[k]].replace("_", " ")
        yield _Part("marker", f"{k} ({where}) in {r.name}", markers & (w.marker == k))


def _limbs(
    recording: Recording, markers: BoolArray, limb: IndexArray, person: PersonShape
) -> Iterator[_Part]:
    """Yields the person's limbs.

    Args:
        recording: recording that the parts are named after.
        markers: (N,) mask of its marker values.
        limb: index of the limb of each of these values, −1 for none.
        person: person with these limbs.
    """
    for number, name in enumerate(person.LIMB_NAMES):
        rows = _among(markers, limb == number)
        yield _Part("limb", f"{name.replace('_', ' ')} in {recording.name}", rows)


def _phases(
    recording: Recording, markers: BoolArray, phase: IndexArray, touching: BoolArray
) -> Iterator[_Part]:
    """Yields the phases of the motion, with contact and without.

    Args:
        recording: recording that the parts are named after.
        markers: (N,) mask of its marker values.
        phase: phase of each of these values, 0 to 2.
        touching: for each of these values, whether the garment touches the person.
    """
    for number, name in enumerate(("at rest", "slow", "fast")):
        for touch in (False, True):
            rows = _among(markers, (phase == number) & (touching == touch))
            text = f"{name}, {'in contact' if touch else 'free'}, in {recording.name}"
            yield _Part("phase", text, rows)


def _seconds(w: Whitening, markers: BoolArray, recording: Recording) -> Iterator[_Part]:
    """Yields each second of a recording; `markers` (N,) masks its marker values."""
    for second in range(int(np.ceil(recording.duration))):
        rows = markers & (w.time >= second) & (w.time < second + 1)
        yield _Part("time", f"{second} to {second + 1} s of {recording.name}", rows)


def _among(rows: BoolArray, chosen: BoolArray) -> BoolArray:
    """Returns the mask `rows` (N,) narrowed by `chosen`, which has an entry for each set row."""
    narrowed = np.zeros(len(rows), dtype=np.bool_)
    narrowed[rows] = chosen
    return narrowed


def _phase(recording: Recording, samples: IndexArray) -> IndexArray:
    """Returns (S,) the phase at each sample by gripper speed: at rest (0), slow (1) or fast (2)."""
    speed = _speed(recording)[samples]
    return np.where(speed < _STILL, 0, np.where(speed < _FAST, 1, 2))


def _speed(recording: Recording) -> FloatArray:
    """Returns (T,) the speed of the faster gripper, m/s."""
    rate = np.gradient(recording.gripper_position, recording.time, axis=0)
    speed: FloatArray = np.linalg.norm(rate, axis=2).max(axis=1)
    return speed


def _regions(mesh: GarmentMesh, points: FloatArray) -> IndexArray:
    """Returns (m,) the region of the node nearest to each point (m,3) of the rest shape."""
    distance = np.linalg.norm(points[:, None] - mesh.rest_position[None], axis=2)
    return mesh.region[distance.argmin(axis=1)].astype(np.int64)
