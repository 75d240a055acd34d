"""Dressings in Python: results of a run, and effects of the user's own parts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_dress import dressing
from drake_dress.diagrams import run as run_module
from drake_dress.errors import FailedError, UserError

SHORT = ("plant.fidelity=quick", "plant.spacing=0.05", "duration=1.5", "log.rate=20")


class _Requests(LeafSystem):
    """Requests one velocity of both grippers, and records the forces on the left one."""

    def __init__(self, velocity: tuple[float, float, float], missing: str = "") -> None:
        super().__init__()
        self.seen: list[Any] = []
        self.DeclareVectorInputPort("left_gripper_force", 3)
        for side in ("left", "right"):
            name = f"{side}_velocity_request"
            if name != missing:
                self.DeclareVectorOutputPort(name, 3, self._calc(velocity))
        self.DeclareVectorOutputPort("request_time", 1, self._now)

    def _calc(self, velocity: tuple[float, float, float]) -> Any:
        def calc(context: Context, output: BasicVector) -> None:
            self.seen.append(self.GetInputPort("left_gripper_force").Eval(context))
            output.SetFromVector(velocity)

        return calc

    def _now(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([context.get_time()])


@dataclass(frozen=True)
class _Up:
    """w (z of the left gripper − 1.7 m)²."""

    weight: float = 100.0

    def value(self, step: dressing.PlannedStep) -> float:
        return self.weight * self._off(step) ** 2

    def add_slope(self, step: dressing.PlannedStep, slope: dressing.Slope) -> None:
        slope.grippers[0, 2] += 2.0 * self.weight * self._off(step)

    def _off(self, step: dressing.PlannedStep) -> float:
        return float(step.x[step.grip.nodes[step.grip.of_side[0]], 2].mean()) - 1.7


class _Asked:
    history_length, sample_period = 1, 0.05

    def __init__(self) -> None:
        self.asked = 0

    def predict(self, history: np.ndarray, time_step: float, steps: int) -> np.ndarray:
        self.asked += 1
        return np.tile(history[-1], (steps + 1, 1, 1))


def heights(result: dressing.RunResult) -> np.ndarray:
    with result.open_log() as log:
        return np.array(log.gripper_position["left"][:, 2])


def short(*more: str) -> dressing.Scenario:
    return dressing.load_scenario("dummy_standing", [*SHORT, *more])


def test_a_run_tells_what_came_of_it_and_prints_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told: list[str] = []
    result = dressing.run(short(), tmp_path / "new" / "out", report=False, told=told.append)
    assert not result.success
    assert result.reason == result.summary["reason"]
    assert "sleeve not on" in str(result.reason)
    assert any(str(result.reason) in line for line in told)
    assert capsys.readouterr().out == ""
    assert len(heights(result)) > 20


def test_a_run_whose_summary_cannot_be_written_is_told_with_its_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(run_module, "write_summary", full)
    scenario = dressing.load_scenario("dummy_standing", [*SHORT, "duration=0.2"])
    with pytest.raises(FailedError, match=r"summary\.json: could not be written; the log is"):
        dressing.run(scenario, tmp_path / "out", report=False)
    with dressing.open_log(tmp_path / "out" / "run.h5") as log:
        assert len(log.time) > 1


def test_a_cost_of_ones_own_moves_what_it_is_about(tmp_path: Path) -> None:
    own = dressing.OwnParts(costs=(_Up(),))
    usual = heights(dressing.run(short(), tmp_path / "usual", report=False))
    lifted = heights(dressing.run(short(), tmp_path / "lifted", own, report=False))
    assert usual[0] == lifted[0]
    assert lifted[-1] > usual[-1] + 0.02


def test_a_predictor_of_ones_own_is_asked(tmp_path: Path) -> None:
    predictor = _Asked()
    dressing.run(short(), tmp_path, dressing.OwnParts(predictor), report=False)
    assert predictor.asked > 0


def test_a_controller_of_ones_own_moves_the_grippers_through_the_governor(tmp_path: Path) -> None:
    made: list[_Requests] = []

    def make() -> _Requests:
        made.append(_Requests((0.0, 0.0, 0.5)))
        return made[-1]

    result = dressing.run(short(), tmp_path, dressing.OwnParts(controller=make), report=False)
    z = heights(result)
    fastest = short().safety.max_speed
    assert 0.5 * fastest < z[-1] - z[0] < fastest * 1.2
    assert max(np.linalg.norm(force) for force in made[0].seen) > 0.1


def test_the_diagram_runs_by_itself() -> None:
    made = dressing.make_dressing(short())
    simulator = Simulator(made.diagram)
    simulator.AdvanceTo(0.1)
    assert simulator.get_context().get_time() == pytest.approx(0.1)
    assert made.station.diagram.HasOutputPort("cheat_garment_position")


@pytest.mark.parametrize("missing", ["left_velocity_request", "right_velocity_request"])
def test_a_controller_without_its_ports_is_refused(missing: str) -> None:
    own = dressing.OwnParts(controller=lambda: _Requests((0.0, 0.0, 0.0), missing))
    with pytest.raises(ValueError, match=f"no output port {missing}"):
        dressing.make_dressing(short(), own)


def test_a_controller_with_an_unknown_input_is_refused() -> None:
    def make() -> LeafSystem:
        system = _Requests((0.0, 0.0, 0.0))
        system.DeclareVectorInputPort("weather", 1)
        return system

    with pytest.raises(ValueError, match="input port weather, expected any of plan"):
        dressing.make_dressing(short(), dressing.OwnParts(controller=make))


def test_a_scenario_changed_in_python_is_held_against_the_same_rules(tmp_path: Path) -> None:
    scenario = short()
    assert dressing.checked_scenario(scenario) == scenario
    scenario.plant.spacing = -1.0
    with pytest.raises(UserError) as error:
        dressing.run(scenario, tmp_path)
    assert error.value.key == "plant.spacing"
    assert not list(tmp_path.iterdir())


def test_hardware_has_no_diagram_before_it_is_heard() -> None:
    with pytest.raises(ValueError, match="expected simulated"):
        dressing.make_dressing(dressing.load_scenario("lab", ["station.kind=hardware"]))
