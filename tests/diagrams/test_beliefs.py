"""Plausibility of messages: those of dressings pass, and impossible ones prevent a run."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from drake import lcmt_panda_status
from pydrake.lcm import DrakeLcm

from drake_dress.__main__ import main
from drake_dress.diagrams.assemble import described_person, planned_arms
from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.hardware_station import Heard, StationSilentError, listen
from drake_dress.diagrams.scenario import Scenario, load_scenario
from drake_dress.diagrams.scenario.ranges import range_of
from drake_dress.diagrams.scenario.schema import Beliefs
from drake_dress.diagrams.sections.hardware import beliefs, hardware_parameters
from drake_dress.diagrams.setup import read_setup, station_parameters
from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.garment_belief import GarmentTrack, judge_garment
from drake_dress.models.supervision.person_belief import PersonTrack, judge_person
from drake_dress.models.supervision.wrong_points import WRONG_POINTS, Moment
from drake_dress.report.log import RunLog
from drake_dress.systems.point_messages import encode_points

LAB = Path(__file__).parents[2] / "scenarios" / "lab.yaml"
DRESSING = """# two seconds of a person who moves
duration: 2.0
person:
  behaviour:
    kind: active
    motions:
      - turn: {angle_deg: 30, start: 0.2, duration: 1.5}
      - wave: {side: left, start: 0.1, frequency: 0.5}
    tremor: {amplitude: 0.01}
plant: {spacing: 0.05, time_step: 0.01}
controller: {spacing: 0.05, global_mpc: {horizon: 3, max_iterations: 2}}
log: {rate: 50}
"""


@pytest.fixture(scope="module")
def dressing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Scenario, RunLog]]:
    folder = tmp_path_factory.mktemp("dressing")
    path = folder / "moving.yaml"
    path.write_text(DRESSING)
    words = ["--out", str(folder / "out"), "--no-meshcat", "--no-report"]
    assert main(["run", str(path), *words]) == 1
    with RunLog.open(folder / "out" / "run.h5") as log:
        yield load_scenario(path), log


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_dressing_is_believed_from_its_first_message_to_its_last(
    dressing: tuple[Scenario, RunLog], noise: float
) -> None:
    scenario, log = dressing
    mesh = build_garment(scenario.garment, scenario.controller.spacing, LAB.parent)
    bounds = beliefs(scenario.station.hardware.beliefs, station_parameters(scenario, mesh))
    nodes = np.asarray(log.file["estimate/garment/position"], dtype=float)
    joints = np.asarray(log.file["estimate/human/joint_position"], dtype=float)
    velocity = np.gradient(nodes, log.time, axis=0)
    grippers = np.stack([log.gripper_position[side][:] for side in SIDES], axis=1)
    moved = np.linalg.norm(np.diff(grippers, axis=0), axis=2).sum()
    assert len(log.time) > 90
    assert moved > 0.05
    assert np.abs(np.diff(joints, axis=0)).sum() > 0.1
    rng = np.random.default_rng(0)
    garment: GarmentTrack | None = None
    person: PersonTrack | None = None
    for k, time in enumerate(log.time):
        # errors of a person's points must not exceed point_error
        error = rng.normal(size=(6, 3))
        error *= 2.0 * noise / np.linalg.norm(error, axis=1, keepdims=True)
        found, garment = judge_garment(
            nodes[k] + noise * rng.normal(size=nodes[k].shape),
            velocity[k],
            float(time),
            grippers[k],
            garment,
            bounds.garment,
        )
        assert not found.fault, f"{time:.2f} s: {found.reason}"
        found, person = judge_person(joints[k] + error, float(time), person, bounds.person)
        assert not found.fault, f"{time:.2f} s: {found.reason}"


class Lab:
    """Sends the same arms, garment and person each time, with increasing time stamps."""

    def __init__(self, wait: float, stamped: bool = True) -> None:
        scenario = load_scenario(LAB, ["controller.spacing=0.06", f"station.hardware.wait={wait}"])
        at = read_setup(scenario, LAB).as_estimated().station
        mesh = at.mesh
        arms = planned_arms(at, described_person(at))
        self.p, self.lcm = hardware_parameters(scenario.station, at), DrakeLcm("memq://")
        self.joints, self.stamped, self.utime = arms.start, stamped, 0
        hung = np.stack(
            [a.tool_position(q) for a, q in zip(arms.pair.arms, arms.start, strict=True)]
        )
        held = np.stack([mesh.rest_position[mesh.grasp[side]].mean(axis=0) for side in SIDES])
        self.points = {
            "garment": mesh.rest_position + (hung - held).mean(axis=0),
            "person": np.vstack([self.p.beliefs.person.pose.shoulders[[i, i, i]] for i in (0, 1)]),
        }
        upper, fore = self.p.beliefs.person.pose.limbs[0]
        self.points["person"][[1, 4], 2] -= upper
        self.points["person"][[2, 5], 2] -= upper + fore

    def spoil(self, kind: str) -> None:
        name = kind.split("_")[0]
        values = self.points[name]
        self.points[name] = WRONG_POINTS[kind](Moment(values, values, 0))

    def speak(self) -> bool:
        self.utime += 5000
        for i, side in enumerate(SIDES):
            status = lcmt_panda_status()
            status.utime, status.num_joints = self.utime if self.stamped else 0, 7
            status.robot_mode = lcmt_panda_status.kIdle
            status.joint_position = self.joints[i].tolist()
            for name in ("position_desired", "velocity", "velocity_desired"):
                setattr(status, f"joint_{name}", [0.0] * 7)
            for name in ("acceleration_desired", "torque", "torque_desired", "torque_external"):
                setattr(status, f"joint_{name}", [0.0] * 7)
            self.lcm.Publish(f"PANDA_STATUS_{side.upper()}", status.encode())
        for name, points in self.points.items():
            message = encode_points(1e-6 * self.utime, points)
            self.lcm.Publish(f"{name.upper()}_ESTIMATE", message.encode())
        return False

    def listen(self) -> Heard:
        return listen(self.p, self.lcm, stopped=self.speak)


def test_a_sound_lab_is_heard() -> None:
    lab = Lab(wait=5.0)
    heard = lab.listen()
    np.testing.assert_allclose(heard.garment, lab.points["garment"], atol=1e-6)
    np.testing.assert_array_equal(heard.joints, lab.joints)


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("person_hand_zero", r"PERSON_ESTIMATE came impossible: left hand at \(0, 0, 0\)"),
        ("person_swapped", "PERSON_ESTIMATE came impossible: left and right are swapped"),
        ("garment_mm", "GARMENT_ESTIMATE came impossible: coordinates are in mm"),
        ("garment_far", "GARMENT_ESTIMATE came impossible: nodes held by the left gripper 0.4"),
    ],
)
def test_a_run_does_not_begin_on_what_cannot_be(kind: str, told: str) -> None:
    lab = Lab(wait=0.3)
    lab.spoil(kind)
    with pytest.raises(StationSilentError, match=told) as error:
        lab.listen()
    assert "\n" not in str(error.value)
    assert str(error.value).count("_ESTIMATE") == 1


def test_a_utime_that_is_never_filled_in_is_told_as_that() -> None:
    with pytest.raises(StationSilentError) as error:
        Lab(wait=0.3, stamped=False).listen()
    assert str(error.value) == (
        "PANDA_STATUS_LEFT came unstamped: utime is never filled in: it is 0, "
        "PANDA_STATUS_RIGHT came unstamped: utime is never filled in: it is 0 for 0.3 s"
    )


@pytest.mark.parametrize("key", [f.name for f in dataclasses.fields(Beliefs)])
def test_each_bound_is_a_key_with_a_range_around_its_preset(key: str) -> None:
    allowed = range_of(f"station.hardware.beliefs.{key}")
    assert allowed is not None
    assert allowed[0] <= getattr(Beliefs(), key) <= allowed[1]


def test_each_bound_reaches_its_check() -> None:
    keys = [f.name for f in dataclasses.fields(Beliefs)]
    scenario = load_scenario(LAB, ["controller.spacing=0.06"])
    at = read_setup(scenario, LAB).as_estimated().station
    plain = repr(beliefs(scenario.station.hardware.beliefs, at))
    for key in keys:
        value = 0.9 * getattr(Beliefs(), key)
        other = load_scenario(LAB, [f"station.hardware.beliefs.{key}={value}"])
        assert repr(beliefs(other.station.hardware.beliefs, at)) != plain, key
