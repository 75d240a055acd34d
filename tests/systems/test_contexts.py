"""Several simulators of one diagram give what each gives alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, System

from drake_dress.diagrams.station import SimulatedStation
from drake_dress.models.control.policy import DressingPolicy, PolicyParameters
from drake_dress.models.dressing.finish import FinishState
from drake_dress.models.human.learned.predictor import LearnedPredictor
from drake_dress.systems.global_mpc import GlobalMpc
from drake_dress.systems.human_forecast import HumanForecast
from tests.models.human.learned.drawn import drawn_networks, drawn_scene
from tests.needs_mujoco import needs_mujoco
from tests.systems.draped import H, draped_station

Begin = Callable[[Context, int], None]
See = Callable[[Context], np.ndarray]


def _alone(system: System, begin: Begin, see: See, which: int, times: np.ndarray) -> np.ndarray:
    simulator = Simulator(system)
    begin(simulator.get_mutable_context(), which)
    seen = []
    for t in times:
        simulator.AdvanceTo(t)
        seen.append(see(simulator.get_context()))
    return np.array(seen)


def _in_turn(system: System, begin: Begin, see: See, times: np.ndarray) -> list[np.ndarray]:
    """Two simulators that go on in turn, and a copy of the first that goes on from the middle."""
    simulators = [Simulator(system) for _ in range(2)]
    for which, simulator in enumerate(simulators):
        begin(simulator.get_mutable_context(), which)
    seen: list[list[np.ndarray]] = [[], [], []]
    for k, t in enumerate(times):
        if k == len(times) // 2:
            copy = simulators[0].get_context().Clone()
            simulators.append(Simulator(system, copy))
            seen[2] = list(seen[0])
        for which, simulator in enumerate(simulators):
            simulator.AdvanceTo(t)
            seen[which].append(see(simulator.get_context()))
    return [np.array(s) for s in seen]


def _check(system: System, begin: Begin, see: See, times: np.ndarray) -> None:
    in_turn = _in_turn(system, begin, see, times)
    alone = [_alone(system, begin, see, which, times) for which in range(2)]
    assert not np.array_equal(alone[0], alone[1]), "the two do differ"
    np.testing.assert_array_equal(in_turn[0], alone[0])
    np.testing.assert_array_equal(in_turn[1], alone[1])
    np.testing.assert_array_equal(in_turn[2], alone[0])


@pytest.mark.parametrize(
    ("integrator", "layered", "in_worker"),
    [
        ("implicit", False, False),
        ("implicit", True, False),
        ("projective_dynamics", False, False),
        ("implicit", False, True),
        pytest.param("mujoco", True, False, marks=needs_mujoco),
        pytest.param("mujoco", True, True, marks=needs_mujoco),
    ],
)
def test_garments_in_two_contexts_do_not_know_of_each_other(
    integrator: str, layered: bool, in_worker: bool
) -> None:
    """They drape over arms, so that factors of the linear systems are made anew on the way."""
    station = draped_station(integrator=integrator, self_collision=layered, in_worker=in_worker)
    _check(
        station.diagram,
        lambda context, which: _pull(station, context, which),
        lambda context: _garment(station, context),
        np.arange(1, 9) * 10 * H + 1e-9,
    )


def _pull(station: SimulatedStation, context: Context, which: int) -> None:
    for i, side in enumerate(("left", "right")):
        port = station.diagram.GetInputPort(f"{side}_gripper.position_command")
        to = np.array([0.25 - 0.1 * which, 0.05 * which, -0.1])
        port.FixValue(context, station.start_grippers[i] + to)


def _garment(station: SimulatedStation, context: Context) -> np.ndarray:
    here = station.cloth.GetMyContextFromRoot(context)
    names = ("garment_position", "contact_force")
    return np.concatenate([station.cloth.GetOutputPort(name).Eval(here) for name in names])


@dataclass
class _Policy(DressingPolicy):
    """Asks for what it sees, and for what it has seen before."""

    parameters: PolicyParameters = PolicyParameters(time_step=0.1, horizon=8)
    mesh: Any = field(default_factory=lambda: SimpleNamespace(rest_position=np.zeros((1, 3))))

    def initial_state(self) -> Any:
        return SimpleNamespace(shown=(0, 0), finish=FinishState(), before=0.0)

    def decide(
        self,
        state: Any,
        x: Any,
        v: Any,
        joints: Any,
        time: float,
        elapsed_steps: float = 5.0,
        radius: Any = None,
        are_open: bool = False,
    ) -> Any:
        n = self.parameters.horizon
        if x[0, 0] < 0.0:
            raise ValueError("the garment is gone")
        asked = 0.5 * state.before + x[0, 0] + 10.0 * time + 100.0 * elapsed_steps
        asked += 0.0 if radius is None else 1e3 * radius[0, 0]
        plan = SimpleNamespace(velocity=np.full((n, 2, 3), asked), armhole=np.zeros((n, 2, 3)))
        after = SimpleNamespace(shown=state.shown, finish=state.finish, before=asked)
        return after, SimpleNamespace(
            plan=plan, assignment="some", target=np.zeros((n, 2, 3)), release=False, lowers=False
        )


def _fix(mpc: GlobalMpc, context: Context, x: float, ports: int = 3) -> None:
    for i in range(ports):
        port = mpc.get_input_port(i)
        port.FixValue(context, np.full(port.size(), x))


def test_global_solves_in_two_contexts_do_not_know_of_each_other() -> None:
    mpc = GlobalMpc(_Policy(), period=0.5, delay=0.2)

    def see(context: Context) -> np.ndarray:
        plan = mpc.GetOutputPort("plan").Eval(context)
        age = mpc.GetOutputPort("age").Eval(context)[0]
        return np.array([plan.start, plan.velocity[0, 0, 0], age])

    # a step ends while solves are under way
    _check(mpc, lambda context, which: _fix(mpc, context, 1.0 + which), see, np.arange(1, 30) * 0.1)


def test_radii_of_the_prediction_reach_the_policy_if_there_are_any() -> None:
    mpc = GlobalMpc(_Policy(), period=0.5, delay=0.2)
    asked = []
    for ports in (3, 4):
        simulator = Simulator(mpc)
        _fix(mpc, simulator.get_mutable_context(), 2.0, ports)
        simulator.AdvanceTo(0.3)
        plan = mpc.GetOutputPort("plan").Eval(simulator.get_context())
        asked.append(plan.velocity[0, 0, 0])
    assert asked[1] - asked[0] == pytest.approx(1e3 * 2.0)


def test_forecasts_of_two_contexts_do_not_know_of_each_other() -> None:
    """Observations, and how well predictions did, are in the context."""
    predictor = LearnedPredictor(drawn_networks(0))
    system = HumanForecast(predictor, 0.05, 0.1, drawn_scene(0, 1).joints[0])

    def begin(context: Context, which: int) -> None:
        scene = drawn_scene(which, 1)
        system.GetInputPort("joint_position").FixValue(context, scene.joints.ravel())
        system.GetInputPort("sleeve_state").FixValue(context, scene.sleeves.ravel())

    def see(context: Context) -> np.ndarray:
        names = ("mean", "radius", "samples", "intent")
        return np.concatenate([system.GetOutputPort(name).Eval(context) for name in names])

    _check(system, begin, see, np.arange(1, 25) * 0.1 + 1e-6)


def test_a_failure_is_that_of_its_context() -> None:
    mpc = GlobalMpc(_Policy(), period=0.5, delay=0.2, waits=False)
    simulators = [Simulator(mpc) for _ in range(2)]
    for simulator, x in zip(simulators, (-1.0, 1.0), strict=True):
        simulator.set_target_realtime_rate(1.0)
        _fix(mpc, simulator.get_mutable_context(), x)
    failing, sound = simulators
    for _ in range(600):
        failing.AdvanceTo(failing.get_context().get_time() + 0.1)
        if mpc.failure(failing.get_context()) is not None:
            break
    assert "the garment is gone" in str(mpc.failure(failing.get_context()))
    assert mpc.failure(sound.get_context()) is None
    # the process that failed is replaced for whoever comes after
    for _ in range(600):
        sound.AdvanceTo(sound.get_context().get_time() + 0.1)
        plan = mpc.GetOutputPort("plan").Eval(sound.get_context())
        if plan.velocity.any() or mpc.failure(sound.get_context()):
            break
    assert mpc.failure(sound.get_context()) is None
    assert plan.velocity.any()
