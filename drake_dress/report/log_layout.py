"""Initial content of a log: the constants of a run and an empty series for each signal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from drake_dress.models.control.safety import Verdict
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.round_cone import both_radii
from drake_dress.models.sides import SIDES, Side
from drake_dress.report.log_schema import (
    ARM_SERIES,
    CLEARANCES,
    COMPLETE,
    FORECAST_AHEAD,
    INTENT_NAMES,
    JOINT_NAMES,
    LOOPS,
    SCHEMA,
    STAGE_NAMES,
)

_SMALL_CHUNK = 256  # samples per chunk if a sample has few numbers
_BULKY = 100  # numbers in a sample above which each sample is a compressed chunk of its own


@dataclass(frozen=True)
class LogContent:
    """Data about a run as a whole; it determines which series the log has.

    Attributes:
        garment: The plant's garment.
        scenario_text: The resolved scenario, YAML.
        version: Version of drake_dress.
        seed: Seed of the run.
        radius: (6,) limb radius at shoulder, elbow, hand of left, then of right, m.
        joint_names: Names of these six joints.
        capsule_radius: (c,2) radii of the person's capsules at both ends, m, or (c,); None: no
            capsules are logged.
        of_chair: (c,) whether each capsule is of the person's wheelchair; None: there is none.
        estimate_garment: The controller's garment; None: its positions are not logged.
        bases: X_WB (4,4) of each arm, if samples have arms.
        estimated: Whether garment and person are estimates because the truth is not known; contact
            and the person's intent are not logged then.
        forecast: Whether the controllers' predictor forecasts the person, so that this is logged.
    """

    garment: GarmentMesh
    scenario_text: str
    version: str
    seed: int
    radius: npt.ArrayLike
    joint_names: Sequence[str] = JOINT_NAMES
    capsule_radius: npt.ArrayLike | None = None
    of_chair: npt.ArrayLike | None = None
    estimate_garment: GarmentMesh | None = None
    bases: Mapping[Side, npt.ArrayLike] | None = None
    estimated: bool = False
    forecast: bool = False


def begin_log(file: h5py.File, content: LogContent) -> dict[str, h5py.Dataset]:
    """Writes the constants of a run to an empty file and creates its series.

    Args:
        file: HDF5 file, open for writing.
        content: Data about the run.

    Returns:
        The series by name, without samples; their first axis is the sample.
    """
    _write_attributes(file, content)
    layout = _Layout(file)
    layout.garment("/garment", content.garment)
    layout.constant("/human/radius", np.asarray(content.radius, dtype=np.float64).reshape(6), "m")
    _add_garment_and_person(layout, content)
    _add_dressing(layout)
    _add_control(layout)
    layout.joints("/estimate/human/joint_position", content.joint_names)
    if content.bases is not None:
        _add_arms(layout, content.bases)
    if content.estimate_garment is not None:
        _add_estimated_garment(layout, content.estimate_garment)
    if content.capsule_radius is not None:
        _add_capsules(layout, content.capsule_radius)
        if content.of_chair is not None and np.any(content.of_chair):
            of_chair = np.asarray(content.of_chair, dtype=np.int8)
            layout.constant("/human/capsule_of_chair", of_chair)
    return layout.series


def label(dataset: h5py.Dataset, unit: str | None, frame: str | None) -> None:
    """Writes unit and frame, if given, as attributes of a dataset."""
    if unit is not None:
        dataset.attrs["unit"] = unit
    if frame is not None:
        dataset.attrs["frame"] = frame


class _Layout:
    """Creates the datasets of a log.

    Attributes:
        series: Datasets with one row per sample, by name.
    """

    def __init__(self, file: h5py.File) -> None:
        self.series: dict[str, h5py.Dataset] = {}
        self._file = file

    def constant(
        self, name: str, value: npt.NDArray[Any], unit: str | None = None, frame: str | None = None
    ) -> None:
        """Writes a dataset that does not change during the run."""
        label(self._file.create_dataset(name, data=value), unit, frame)

    def garment(self, group: str, garment: GarmentMesh) -> None:
        """Writes a garment's mesh and its openings."""
        self.constant(f"{group}/faces", np.asarray(garment.faces, dtype=np.int32))
        rest = np.asarray(garment.rest_position, dtype=np.float64)
        self.constant(f"{group}/rest_position", rest, "m", "garment")
        for name in LOOPS:
            self.constant(f"{group}/loops/{name}", np.asarray(garment.loops[name], dtype=np.int32))

    def add(
        self,
        name: str,
        shape: tuple[int, ...],
        unit: str,
        frame: str | None = None,
        dtype: str = "f4",
    ) -> h5py.Dataset:
        """Adds a series whose samples have shape `shape`, and returns it."""
        bulky = int(np.prod(shape, dtype=int)) > _BULKY
        # Each compressed row is its own chunk: a growing chunk would be moved, and a killed process
        # could leave the file pointing to the old location.
        options: dict[str, Any] = (
            {"compression": "gzip", "compression_opts": 1, "shuffle": True} if bulky else {}
        )
        dataset = self._file.create_dataset(
            name,
            shape=(0, *shape),
            maxshape=(None, *shape),
            chunks=(1 if bulky else _SMALL_CHUNK, *shape),
            dtype=dtype,
            **options,
        )
        label(dataset, unit, frame)
        self.series[name] = dataset
        return dataset

    def joints(self, name: str, joint_names: Sequence[str]) -> h5py.Dataset:
        """Adds a series of the person's six joints."""
        dataset = self.add(name, (6, 3), "m", "world", dtype="f8")
        dataset.attrs["names"] = list(joint_names)
        return dataset


def _write_attributes(file: h5py.File, content: LogContent) -> None:
    attributes = file.attrs
    attributes["schema"] = SCHEMA
    attributes["scenario"] = content.scenario_text
    attributes["version"] = content.version
    attributes["seed"] = content.seed
    attributes[COMPLETE] = False
    if content.estimated:
        attributes["source"] = "estimate"


def _add_garment_and_person(layout: _Layout, content: LogContent) -> None:
    n = len(content.garment.rest_position)
    layout.add("/time", (), "s", dtype="f8")
    layout.add("/garment/position", (n, 3), "m", "world")
    if not content.estimated:
        layout.add("/garment/contact", (n,), "1", dtype="i1")
        layout.add("/garment/contact_force", (n, 3), "N", "world")
        intent = layout.add("/human/intent", (2,), "1", dtype="i1")
        intent.attrs["names"] = list(SIDES)
        intent.attrs["values"] = list(INTENT_NAMES)
    layout.joints("/human/joint_position", content.joint_names)
    if content.forecast:
        soon = layout.joints("/forecast/human/joint_position", content.joint_names)
        radius = layout.add("/forecast/human/radius", (6,), "m")
        for dataset in (soon, radius):
            dataset.attrs["ahead"] = FORECAST_AHEAD
        radius.attrs["names"] = list(content.joint_names)
        intent = layout.add("/forecast/human/intent", (2,), "1")
        intent.attrs["names"] = list(SIDES)
        layout.add("/forecast/human/is_linear", (), "1", dtype="i1")


def _add_dressing(layout: _Layout) -> None:
    """Adds grippers and dressing coordinates of both sides."""
    for side in SIDES:
        layout.add(f"/gripper/{side}/position", (3,), "m", "world", dtype="f8")
        layout.add(f"/gripper/{side}/force", (3,), "N", "world", dtype="f8")
        for name, unit in (("s", "1"), ("l", "m"), ("theta", "rad")):
            layout.add(f"/dressing/{side}/{name}", (), unit, dtype="f8")


def _add_control(layout: _Layout) -> None:
    """Adds stages, verdicts of the safety governor, and the controllers' solves."""
    stage = layout.add("/control/stage", (2,), "1", dtype="i1")
    stage.attrs["names"] = list(SIDES)
    stage.attrs["values"] = list(STAGE_NAMES)
    safety = layout.add("/control/safety", (2,), "1", dtype="i2")
    safety.attrs["names"] = list(SIDES)
    safety.attrs["flags"] = [f"{v.value} {v.name}" for v in Verdict]
    for name in ("global", "local"):
        layout.add(f"/control/{name}/solve_time", (), "s", dtype="f8")
        layout.add(f"/control/{name}/solves", (), "1", dtype="i2")


def _add_arms(layout: _Layout, bases: Mapping[Side, npt.ArrayLike]) -> None:
    for side in SIDES:
        layout.constant(f"/arm/{side}/base", np.asarray(bases[side], dtype=np.float64), "m")
        for name, unit in ARM_SERIES:
            layout.add(f"/arm/{side}/{name}", (7,), unit, dtype="f8")
    layout.add("/arm/clearance", (3,), "m", dtype="f8").attrs["names"] = list(CLEARANCES)


def _add_estimated_garment(layout: _Layout, garment: GarmentMesh) -> None:
    layout.garment("/estimate/garment", garment)
    m = len(garment.rest_position)
    layout.add("/estimate/garment/position", (m, 3), "m", "world")


def _add_capsules(layout: _Layout, radius: npt.ArrayLike) -> None:
    radii = both_radii(np.asarray(radius, dtype=np.float64))
    layout.constant("/human/capsule_radius", radii[:, 0], "m")
    if np.any(radii[:, 1] != radii[:, 0]):
        layout.constant("/human/capsule_end_radius", radii[:, 1], "m")
    for end in "ab":
        layout.add(f"/human/capsule_{end}", (len(radii), 3), "m", "world", dtype="f8")
