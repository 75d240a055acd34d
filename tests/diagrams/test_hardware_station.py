"""The hardware station: the same ports as in simulation, and a defined reaction to each fault.

Lab and run share one diagram and a bus in memory here; `tests/benchmarks/test_hardware_bench.py`
runs two processes.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydrake.lcm import DrakeLcm
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder, PortDataType

from drake_dress.diagrams.assemble import described_person, planned_arms, simulated_station
from drake_dress.diagrams.dressing import make_dressing
from drake_dress.diagrams.hardware_station import (
    HardwareStation,
    Heard,
    NotAtStartError,
    StationSilentError,
    at_start,
    listen,
    make_hardware_station,
)
from drake_dress.diagrams.lab_diagram import LabDiagram, make_lab
from drake_dress.diagrams.planning import ControlSetup
from drake_dress.diagrams.scenario import Scenario, apply_variation, load_scenario
from drake_dress.diagrams.scenario.schema import LabFault
from drake_dress.diagrams.sections.hardware import hardware_parameters
from drake_dress.diagrams.setup import read_setup
from drake_dress.models.arm.command_guard import Stop
from drake_dress.models.arm.panda import LIMITS
from drake_dress.models.sides import SIDES
from tests.drawing import drawn_seed

SOURCE = Path(__file__).parents[2] / "scenarios" / "lab.yaml"
COARSE = ("plant.spacing=0.06", "controller.spacing=0.06", "plant.iterations=5")
# Time until a fault is detected, and braking time from the largest speed by max_acceleration, s.
SEEN = 0.05 + 0.005 + 0.005 + 0.01
BRAKED = 0.12 / 2.0


CAMERA = (
    "station.cameras=[{name: front, position: [2.2, 0.8, 1.6], target: [0.0, 0.0, 1.1], "
    "width: 80, height: 60, rate: 10}]"
)


def load(*more: str) -> Scenario:
    return apply_variation(load_scenario(SOURCE, [*COARSE, *more]))


class Pair:
    """A lab and a run in one simulator."""

    def __init__(self, *faults: LabFault, settings: tuple[str, ...] = ()) -> None:
        self.scenario = scenario = load(*settings)
        scenario.lab.faults = list(faults)
        setup = read_setup(scenario, SOURCE)
        lcm = DrakeLcm("memq://")
        self.simulated = simulated_station(setup)
        self.lab: LabDiagram = make_lab(setup, self.simulated, lcm, writer=None)
        at = setup.as_estimated().station
        person = described_person(at)
        p = replace(hardware_parameters(scenario.station, at), wall=False)
        assert self.simulated.robots is not None
        joints = self.simulated.robots.start
        robots = at_start(p, planned_arms(at, person), joints)
        policy = setup.policy(person)
        diagram = self.simulated.diagram
        seen = {
            name: diagram.GetOutputPort(f"estimate.{name}")
            .Eval(diagram.CreateDefaultContext())
            .reshape(-1, 3)
            for name in ("garment_position", "joint_position")
        }
        heard = Heard(joints, seen["garment_position"], seen["joint_position"])
        self.station: HardwareStation = make_hardware_station(p, lcm, person, robots, heard)
        control = ControlSetup(policy, setup.rates, setup.limits)
        self.dressing = make_dressing(self.station, setup.garments.belief, control)
        builder = DiagramBuilder()
        builder.AddNamedSystem("lab", self.lab.diagram)
        builder.AddNamedSystem("run", self.dressing.diagram)
        self.simulator = Simulator(builder.Build())
        # as in a run, everything must be compiled before plans are awaited
        self.dressing.rehearse(heard.garment, heard.person, lambda: False)
        self.simulator.Initialize()
        self.root = self.simulator.get_context()

    def read(self, system: Diagram, port: str) -> Any:
        """Returns the value of a port: a vector, an image or another object."""
        return system.GetOutputPort(port).Eval(system.GetMyContextFromRoot(self.root))

    def run(self, until: float) -> list[dict[str, np.ndarray]]:
        """Advances to simulated time `until`, s; returns a record every 5 ms."""
        rows = []
        now = self.root.get_time()
        inside = self.simulated.diagram
        while now < until - 1e-9:
            now += 0.005
            self.simulator.AdvanceTo(now)
            rows.append(
                {
                    "time": np.array([now]),
                    "permission": self.read(self.station.diagram, "permission"),
                    "since": self.lab.player.GetOutputPort("since").Eval(
                        self.lab.player.GetMyContextFromRoot(self.root)
                    ),
                    **{
                        f"{side}_{name}": self.read(inside, f"{side}_arm.{name}_measured")
                        for side in SIDES
                        for name in ("position", "velocity", "torque")
                    },
                    **{
                        f"{side}_gripper": self.read(inside, f"{side}_gripper.velocity_measured")
                        for side in SIDES
                    },
                    **{f"{s}_stop": self.read(inside, f"cheat_{s}_arm_stop") for s in SIDES},
                }
            )
        return rows

    def conclusion(self) -> str | None:
        watch = self.station.watch
        return watch.conclusion(watch.GetMyContextFromRoot(self.root))

    def events(self) -> tuple[tuple[float, str], ...]:
        watch = self.station.watch
        return watch.events(watch.GetMyContextFromRoot(self.root))

    def dropped(self) -> dict[str, int]:
        watch = self.station.watch
        return watch.dropped(watch.GetMyContextFromRoot(self.root))


def test_both_stations_have_the_same_ports() -> None:
    pair = Pair(settings=(CAMERA,))

    def ports(diagram: Diagram) -> dict[str, tuple[str, PortDataType, int]]:
        both = [("in", diagram.get_input_port(i)) for i in range(diagram.num_input_ports())] + [
            ("out", diagram.get_output_port(i)) for i in range(diagram.num_output_ports())
        ]
        return {
            port.get_name(): (way, port.get_data_type(), port.size())
            for way, port in both
            if not port.get_name().startswith("cheat_")
        }

    assert ports(pair.station.diagram) == ports(pair.simulated.diagram)
    # arms, their status, whether they stopped, grippers, estimates, permission, camera, and the
    # end: release, cue, and whether grippers are open
    assert len(ports(pair.station.diagram)) == 4 + 16 + 2 + 6 + 3 + 1 + 2 + 3


def test_images_arrive_as_they_were_taken() -> None:
    pair = Pair(settings=(CAMERA,))
    pair.run(0.305)
    for kind in ("color", "depth"):
        seen = pair.read(pair.station.diagram, f"front.{kind}_image").data
        taken = pair.read(pair.simulated.diagram, f"front.{kind}_image").data
        assert seen.shape == taken.shape == (60, 80, 4 if kind == "color" else 1)
        # garment and person are still, but for millimetres since the image was sent
        same = np.isclose(seen.astype(float), taken.astype(float), rtol=0.02, atol=3.0)
        assert (same | (np.isinf(seen) & np.isinf(taken))).mean() > 0.97
    depth = pair.read(pair.station.diagram, "front.depth_image").data
    assert 1.5 < depth[np.isfinite(depth)].min() < 2.5


def limits_are_kept(rows: list[dict[str, np.ndarray]]) -> None:
    for side in SIDES:
        q, v, torque = (
            np.array([r[f"{side}_{n}"] for r in rows]) for n in ("position", "velocity", "torque")
        )
        assert ((q >= LIMITS.lower) & (q <= LIMITS.upper)).all()
        assert (np.abs(v) <= LIMITS.speed).all()
        assert (np.abs(torque) <= LIMITS.torque).all()


def test_without_faults_arms_follow_over_the_bus() -> None:
    pair = Pair()
    rows = pair.run(2.0)
    limits_are_kept(rows)
    assert rows[-1]["permission"][0] == 1.0
    assert pair.conclusion() is None
    travelled = 0.005 * sum(np.linalg.norm(r["left_gripper"]) for r in rows)
    assert travelled > 0.05
    for side in SIDES:
        assert rows[-1][f"{side}_stop"][0] == Stop.NONE
        asked = pair.read(pair.simulated.diagram, f"{side}_arm.position_commanded")
        assert np.abs(rows[-1][f"{side}_position"] - asked).max() < 0.01


@pytest.mark.parametrize(
    ("kind", "source", "ends"),
    [
        ("stale", "left_arm", None),
        ("stale", "garment", None),
        ("stale", "person", None),
        ("stale", "camera_front", None),
        ("malformed", "camera_front", None),
        ("malformed", "right_arm", None),
        ("malformed", "person", None),
        ("nan", "left_arm", None),
        ("nan", "garment", None),
        ("person_hand_zero", "person", None),
        ("garment_mirrored", "garment", None),
        ("mode_unknown", "right_arm", None),
        ("joint_leap", "left_arm", "left arm: speed limit"),
        ("bus_lost", "", None),
        ("arm_lost", "right_arm", None),
        ("time_back", "left_arm", "left arm: time back"),
        ("clock_jump", "garment", "garment: clock jump"),
        ("joint_limit", "right_arm", "right arm: joint limit"),
    ],
)
def test_at_a_fault_both_arms_hold_then_go_on_or_the_run_ends(
    kind: str, source: str, ends: str | None
) -> None:
    start = float(np.random.default_rng(drawn_seed()).uniform(0.8, 1.5))
    camera = source.startswith("camera")
    lasting = 1.0 if camera else 0.6
    pair = Pair(LabFault(kind, source, start, lasting), settings=(CAMERA,) if camera else ())
    rows = pair.run(start + lasting + 0.6)
    limits_are_kept(rows)
    # an estimate, and even more an image, becomes stale later than a status
    seen = SEEN + (0.2 if kind == "stale" and source in ("garment", "person") else 0.0)
    seen += 0.5 + 0.1 if camera and kind == "stale" else 0.1 if camera else 0.0
    seen += 1.0 / pair.scenario.station.hardware.estimate_rate
    since = np.array([r["since"][0] for r in rows])
    held = (since >= start + seen + BRAKED + 0.1) & (since <= start + lasting)
    speed = np.array([[np.linalg.norm(r[f"{s}_gripper"]) for s in SIDES] for r in rows])
    permitted = np.array([r["permission"][0] for r in rows])
    before = (since > 0.5) & (since < start)
    assert speed[before].max() > 0.03, "nothing moved, so that nothing could hold"
    assert (permitted[(since >= start + seen) & (since <= start + lasting)] == 0.0).all()
    assert speed[held].max() < 0.01
    if ends is None:
        assert pair.conclusion() is None
        assert permitted[-1] == 1.0
    else:
        told = pair.conclusion()
        assert told is not None
        assert told.startswith(ends.split(":")[0])
        assert ends.split(": ")[1] in told
        assert (permitted[since > start + seen] == 0.0).all()


def test_a_fault_that_lasts_ends_the_run() -> None:
    pair = Pair(
        LabFault("stale", "left_arm", 0.5, 100.0), settings=("station.hardware.patience=0.5",)
    )
    pair.run(1.5)
    assert pair.conclusion() == "left arm: stale"


def test_a_push_is_yielded_to() -> None:
    pair = Pair(LabFault("push", "left_arm", 0.8, 0.8), settings=("lab.push=30.0",))
    rows = pair.run(2.0)
    limits_are_kept(rows)
    since = np.array([r["since"][0] for r in rows])
    pushed = (since > 1.0) & (since < 1.6)
    along = np.array([r["left_gripper"] @ [-0.8, 0.6, 0.0] for r in rows])
    assert 0.01 < along[pushed].mean() < 0.15


def test_arms_stop_by_themselves_when_commands_end() -> None:
    """Their own drivers stop them: here no commands get through, whatever the run sends."""
    pair = Pair(LabFault("bus_lost", "", 0.8, 1.0))
    rows = pair.run(1.9)
    limits_are_kept(rows)
    since = np.array([r["since"][0] for r in rows])
    for side in SIDES:
        stop = np.array([r[f"{side}_stop"][0] for r in rows])
        late = since > 0.8 + pair.scenario.lab.stale_command + 0.02
        assert (stop[late & (since < 1.7)] == Stop.ENDED).all()
        speed = np.array([np.abs(r[f"{side}_velocity"]).max() for r in rows])
        assert speed[(since > 1.2) & (since < 1.7)].max() < 0.02


# plans come late beside other work, and then the grippers come to rest
@pytest.mark.alone
def test_an_arm_whose_commands_went_astray_meanwhile_follows_again() -> None:
    """A driver resumes only with commands that start at its held position."""
    pair = Pair(LabFault("bus_lost", "", 0.8, 0.6))
    pair.run(1.2)
    controller = pair.dressing.diagram.GetSubsystemByName("arm_controller")
    context = controller.GetMyMutableContextFromRoot(pair.root)
    commands = context.get_mutable_discrete_state(0)
    commands.SetAtIndex(7 + 3, commands.GetAtIndex(7 + 3) + 0.06)
    rows = pair.run(2.0)
    limits_are_kept(rows)
    assert pair.conclusion() is None
    for side in SIDES:
        stop = np.array([r[f"{side}_stop"][0] for r in rows])
        assert Stop.ENDED in stop
        assert stop[-1] == Stop.NONE
    speed = [np.linalg.norm(r["right_gripper"]) for r in rows[-60:]]
    assert max(speed) > 0.01


def test_a_run_does_not_start_from_elsewhere() -> None:
    scenario = load()
    at = read_setup(scenario, SOURCE).as_estimated().station
    planned = planned_arms(at, described_person(at))
    p = hardware_parameters(scenario.station, at)
    joints = planned.start.copy()
    joints[1, 3] += 0.15
    with pytest.raises(NotAtStartError, match=r"right arm is .* rad from where the run begins"):
        at_start(p, planned, joints)
    joints[1, 3] -= 0.15 - 0.01
    np.testing.assert_allclose(at_start(p, planned, joints).start, joints, atol=0.021)


def test_silence_is_told_with_its_channels() -> None:
    scenario = load("station.hardware.wait=0.2")
    p = hardware_parameters(scenario.station, read_setup(scenario, SOURCE).as_estimated().station)
    lcm = DrakeLcm("memq://")

    def speak() -> bool:
        lcm.Publish("PANDA_STATUS_LEFT", b"nonsense")
        return False

    with pytest.raises(
        StationSilentError, match=r"PANDA_STATUS_LEFT came malformed.*PERSON_ESTIMATE is silent"
    ):
        listen(p, lcm, stopped=speak)


def test_messages_out_of_order_hold_nothing_and_are_counted() -> None:
    of = {
        "left_arm": "reordered",
        "right_arm": "duplicated",
        "garment": "set_back",
        "person": "reordered",
    }
    pair = Pair(*(LabFault(kind, source, 0.4, 0.8) for source, kind in of.items()))
    rows = pair.run(1.4)
    permitted = np.array([r["permission"][0] for r in rows])
    since = np.array([r["since"][0] for r in rows])
    assert (permitted[since > 0.3] == 1.0).all()
    assert pair.conclusion() is None
    dropped = pair.dropped()
    assert dropped["left_arm"] > 20
    assert dropped["right_arm"] > 20
    assert dropped["person"] > 5
    # with an estimate every 20 ms, a clock set back by 8 ms puts no message out of order
    assert dropped["garment"] == 0


def test_what_is_refused_is_told_in_the_events() -> None:
    pair = Pair(LabFault("person_limb", "person", 0.4, 0.3))
    pair.run(1.2)
    lines = [line for _, line in pair.events()]
    refused = next(i for i, line in enumerate(lines) if "forearm" in line)
    assert lines[refused] == "person: left forearm 0.96 m, expected 0.21 to 0.43 m (impossible)"
    assert lines[refused + 1] == "arms hold"
    assert lines[-2:] == ["person: sound", "arms may move"]
