"""Tracks the coat of recorded dressings, and compares it with the truth."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from benchmarks.dressing.cases import PERSONS, SCENARIOS, VARIATIONS
from benchmarks.perception.recording import Recording, oracle_parts, record
from drake_dress.diagrams.assemble import Parts
from drake_dress.diagrams.eyes import delayed_tracker, start_of_tracking
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.setup import Setup
from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.dressing.sleeve import loop_orientation, sleeve_state
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.garment.transfer import barycentric_transfer
from drake_dress.models.perception.delayed_tracking import Exposure, Motion
from drake_dress.models.perception.depth_buffer import depth_buffer, pixel_indices, seen
from drake_dress.models.perception.garment_filter import View
from drake_dress.models.sides import SIDES
from drake_dress.systems.garment_geometry import GARMENT_LABEL
from drake_dress.yaml_text import read_yaml

# How the coat is tracked, by name: the cameras that are used.
WAYS: dict[str, tuple[int, ...]] = {
    "tracker": (0, 1),
    "without the front camera": (1,),
    "without the rear camera": (0,),
    "simulation alone": (),
}
_CAMERAS = SCENARIOS / "dummy_cameras.yaml"
_COMPARED = 6  # ticks between comparisons
_SETTLED = 1.0  # s from the start until the first comparison
_BEHIND, _COVERED = 0.02, 0.06  # m behind garment, or behind what is measured, of hidden nodes


@dataclass(frozen=True)
class Case:
    """A dressing that is recorded: a person of PERSONS and a seed."""

    person: str
    seed: int

    @property
    def name(self) -> str:
        """Name for files and tables."""
        return f"{self.person}-{self.seed}"


def run(case: Case, keep: Path | None, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Records a dressing whose controller knows the truth, and tracks its coat in each way.

    Args:
        case: dressing to record.
        keep: folder for the recording; None to keep none. One that is there is not made again.
        overrides: further KEY=VALUE settings of the scenario.
    """
    source = SCENARIOS / PERSONS[case.person]
    scenario = load_scenario(source, [*_settings(), *overrides], case.seed)
    p = oracle_parts(scenario, source)
    file = None if keep is None else keep / f"{case.name}.npz"
    if file is not None and file.exists():
        recording = Recording.load(file)
    else:
        recording = record(p, scenario.duration)
        if file is not None:
            file.parent.mkdir(parents=True, exist_ok=True)
            recording.save(file)
    ways = {way: errors_of(p, recording, cameras) for way, cameras in WAYS.items()}
    return {"case": asdict(case), "summary": {"success": True, "ways": ways}}


@lru_cache
def _settings() -> tuple[str, ...]:
    """Returns the settings that give a scenario the cameras of `dummy_cameras.yaml`."""
    content = read_yaml(str(_CAMERAS), _CAMERAS.read_text(encoding="utf-8"))
    station = content["station"]
    return (
        "perception.kind=cameras",
        f"variation={VARIATIONS['few']}",
        f"station.cameras={json.dumps(station['cameras'])}",
        f"station.camera_errors={json.dumps(station['camera_errors'])}",
    )


def errors_of(p: Parts, recording: Recording, cameras: Sequence[int]) -> dict[str, float]:
    """Returns the errors of tracking with some cameras.

    Args:
        p: parts of the recorded scenario.
        recording: of the dressing.
        cameras: numbers of those that are used.
    """
    setup, r = p.setup, recording
    tracker = delayed_tracker(setup, p.policy)
    tracking = start_of_tracking(tracker, setup, motion_of(r, 0))
    compare = _Comparison(setup, recording)
    ticks = round(setup.scenario.perception.period / tracker.time_step)
    latency, used = setup.scenario.station.camera_errors.latency, -1
    rows = []
    for k in range(1, len(r.time)):
        tracking = tracker.advanced(tracking, [motion_of(r, k)])
        arrived = np.flatnonzero(r.exposed + latency <= r.time[k] + 1e-6)
        if k % ticks == 0 and cameras and len(arrived) and arrived[-1] > used:
            used = int(arrived[-1])
            views = tuple(_view(setup, r, used, camera) for camera in cameras)
            tracking = tracker.seen(tracking, [Exposure(float(r.exposed[used]), views)])
        if k % _COMPARED == 0 and r.time[k] >= _SETTLED:
            rows.append(compare(k, tracking.now.garment.cloth.x))
    return _told(np.array(rows))


def motion_of(recording: Recording, k: int) -> Motion:
    """Returns what leads the garment at a sample."""
    r = recording
    return Motion(float(r.time[k]), r.grippers[k], r.joints[k], bool(r.are_open[k] > 0.5))


def _view(setup: Setup, recording: Recording, number: int, camera: int) -> View:
    labels = recording.labels[number, camera].astype(np.int32)
    depth = recording.depth_of(number)[camera]
    return View(setup.station.cameras[camera].pinhole, depth, labels, GARMENT_LABEL)


class _Comparison:
    """Compares a tracked garment with the true one."""

    def __init__(self, setup: Setup, recording: Recording) -> None:
        mesh = setup.garments.tracked
        if mesh is None:
            raise ValueError("the setup has no tracked garment")
        self._setup, self._recording = setup, recording
        self._mesh: GarmentMesh = mesh
        self._transfer: sp.csr_array = barycentric_transfer(setup.garments.plant, mesh)
        self._signs = [loop_orientation(mesh, side) for side in SIDES]

    def __call__(self, k: int, x: FloatArray) -> list[float]:
        """Returns the errors of nodes `x` at sample `k`.

        These are the mean of all nodes and of hidden ones, m, the share that is hidden, and of left
        and right armhole the errors of centre, m, and direction, degrees.
        """
        plant = self._recording.garment[k].astype(float)
        true = np.asarray(self._transfer @ plant)
        off = np.linalg.norm(x - true, axis=1)
        hidden = self._hidden(k, plant, true)
        row = [off.mean(), off[hidden].mean() if hidden.any() else np.nan, hidden.mean()]
        centres, angles = [], []
        for side, sign in zip(SIDES, self._signs, strict=True):
            loop = np.asarray(self._mesh.loops[f"{side}_armhole"])
            found, asked = (sleeve_state(nodes, loop, sign) for nodes in (x, true))
            centres.append(float(np.linalg.norm(found.p_c - asked.p_c)))
            cosine = np.clip(found.v_c @ asked.v_c, -1.0, 1.0)
            angles.append(float(np.degrees(np.arccos(cosine))))
        return [*row, *centres, *angles]

    def _hidden(self, k: int, plant: FloatArray, true: FloatArray) -> BoolArray:
        """Returns which nodes no camera sees, behind other cloth or the person."""
        r = self._recording
        faces = self._setup.garments.plant.faces
        number = max(int(np.searchsorted(r.exposed, r.time[k] + 1e-9)) - 1, 0)
        visible = np.zeros(len(true), dtype=bool)
        for c, camera in enumerate(self._setup.station.cameras):
            pinhole = camera.pinhole
            coarse = pinhole.coarser(2)
            sees = seen(coarse, depth_buffer(coarse, plant, faces), true, _BEHIND)
            pixels, z = pinhole.pixels(true)
            place, inside = pixel_indices(pinhole, pixels, z)
            depth = r.depth_of(number)[c][place[:, 1], place[:, 0]]
            covered = inside & (depth > 0.0) & (depth < z - _COVERED)
            visible |= sees & ~covered
        return ~visible


def _told(rows: FloatArray) -> dict[str, float]:
    node, hidden, share = rows[:, :3].T
    centres, angles = rows[:, 3:5], rows[:, 5:7]
    return {
        "node_mean_m": float(node.mean()),
        "hidden_mean_m": float(np.nanmean(hidden)),
        "hidden_share": float(share.mean()),
        "armhole_median_m": float(np.median(centres)),
        "armhole_95_m": float(np.percentile(centres, 95.0)),
        "direction_median_deg": float(np.median(angles)),
        "direction_95_deg": float(np.percentile(angles, 95.0)),
    }
