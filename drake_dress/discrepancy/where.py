"""Where, when and in which signal the simulation is off most, beyond noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.discrepancy.lab import PersonShape
from drake_dress.discrepancy.recording import Recording
from drake_dress.discrepancy.whitening import Whitening
from drake_dress.models.cloth.contact.distance import nearest_obstacle
from drake_dress.models.garment.mesh import REGION_NAMES, GarmentMesh

FloatArray = npt.NDArray[np.float64]
# Phases by the grippers' speed, m/s, and by contact.
_STILL, _FAST = 0.01, 0.15
# A marker no farther than this from a limb's skin is of the cloth that lies on it, m.
_ON_LIMB = 0.02
KINDS = ("signal", "recording", "region", "limb", "phase", "time", "marker")


@dataclass(frozen=True)
class Spot:
    """A part of the data and how far off it is.

    Attributes:
        kind: one of `KINDS`.
        name: of the part.
        rms: residual, m or N.
        noise: of it.
        whitened: mean squared residual in units of the noise; 1 where there is nothing but noise.
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
    samples: Sequence[npt.NDArray[np.int64]],
    person: PersonShape,
) -> list[Spot]:
    """Returns all parts, worst first.

    Args:
        whitening: of the data.
        predicted: (N,) whitened, what the simulation says.
        recordings: what was measured.
        mesh: that markers sit on.
        contact: share of nodes in contact at each compared sample of each recording.
        samples: indices that are compared, of each recording.
        person: whose limbs the garment touches.
    """
    w = whitening
    squared = (w.data - predicted) ** 2
    size = w.size(w.data - predicted)
    noise = w.sensor
    found: list[Spot] = []

    def add(kind: str, name: str, rows: npt.NDArray[np.bool_]) -> None:
        if not rows.any():
            return
        dimensions = 1 if w.is_force[rows].all() else 3
        found.append(
            Spot(
                kind,
                name,
                float(np.sqrt(dimensions * np.mean(size[rows] ** 2))),
                float(np.sqrt(dimensions * np.mean(noise[rows] ** 2))),
                float(np.mean(squared[rows])),
            )
        )

    markers = ~w.is_force
    add("signal", "markers", markers)
    for k, side in enumerate(("left", "right")):
        add("signal", f"force of the {side} gripper", w.is_force & (w.marker == k))
    for i, r in enumerate(recordings):
        mine = w.recording == i
        add("recording", r.name, mine & markers)
        region = _regions(mesh, r.marker_rest_position)
        for number, name in enumerate(REGION_NAMES):
            rows = mine & markers & np.isin(w.marker, np.flatnonzero(region == number))
            add("region", f"{name.replace('_', ' ')} in {r.name}", rows)
        for k in range(r.marker_position.shape[1]):
            where = REGION_NAMES[region[k]].replace("_", " ")
            add("marker", f"{k} ({where}) in {r.name}", mine & markers & (w.marker == k))
        speed = _speed(r)[samples[i]]
        phase = np.where(speed < _STILL, 0, np.where(speed < _FAST, 1, 2))
        touching = contact[i] > 0.0
        at = np.searchsorted(r.time[samples[i]] - r.time[0], w.time[mine] - 1e-9)
        at = np.minimum(at, len(phase) - 1)
        limb = limbs_touched(r, samples[i], person)
        of_marker = np.full(len(mine), -1)
        on_cloth = mine & markers
        of_marker[on_cloth] = limb[at[markers[mine]], w.marker[on_cloth]]
        for number, name in enumerate(person.LIMB_NAMES):
            add("limb", f"{name.replace('_', ' ')} in {r.name}", of_marker == number)
        for number, name in enumerate(("at rest", "slow", "fast")):
            for touch in (False, True):
                rows = np.zeros(len(mine), dtype=np.bool_)
                rows[mine] = (phase[at] == number) & (touching[at] == touch)
                text = f"{name}, {'in contact' if touch else 'free'}, in {r.name}"
                add("phase", text, rows & markers)
        for second in range(int(np.ceil(r.duration))):
            rows = mine & markers & (w.time >= second) & (w.time < second + 1)
            add("time", f"{second} to {second + 1} s of {r.name}", rows)
    return sorted(found, key=lambda s: -s.whitened)


def worst(found: Sequence[Spot], most: int = 3) -> list[Spot]:
    """Returns the first `most` spots of each kind, from the whole to the fine.

    Args:
        found: worst first.
        most: of a kind.
    """
    return [s for kind in KINDS for s in [s for s in found if s.kind == kind][:most]]


def limbs_touched(
    recording: Recording, samples: npt.NDArray[np.int64], person: PersonShape
) -> npt.NDArray[np.int64]:
    """Returns (S,m) the limb, of `person.LIMB_NAMES`, that each marker was seen on, or −1.

    Args:
        recording: whose joints, where they were measured, place the limbs.
        samples: (S,) indices.
        person: its pose and sizes.
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


def _speed(recording: Recording) -> FloatArray:
    """Returns (T,) of the faster gripper, m/s."""
    rate = np.gradient(recording.gripper_position, recording.time, axis=0)
    speed: FloatArray = np.linalg.norm(rate, axis=2).max(axis=1)
    return speed


def _regions(mesh: GarmentMesh, points: FloatArray) -> npt.NDArray[np.int64]:
    """Returns (m,) the region of the node nearest to each point (m,3) of the rest shape."""
    distance = np.linalg.norm(points[:, None] - mesh.rest_position[None], axis=2)
    return mesh.region[distance.argmin(axis=1)].astype(np.int64)
