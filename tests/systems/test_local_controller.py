"""The local controller as a system: when it solves, when that is used, and what it says of it."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

from drake_dress.models.control.local_control import GlobalPlan, LocalController
from drake_dress.models.control.local_model import LocalParameters
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.task_parameters import TaskParameters
from drake_dress.models.control.tasks import Assignment, TaskPlanner
from drake_dress.models.dressing.stages import SleeveFacts, Task
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.human.body import ArmPose, BodyMeasures, arm_points
from drake_dress.models.sides import SIDES
from drake_dress.systems.local_controller import LocalCompensation

PERIOD, DELAY = 0.02, 0.005
OFF = SleeveFacts(linked=False, s=0.0, hand_distance=0.5, prepared_error=0.5, passed=0.0)


@pytest.fixture(scope="module")
def controller() -> LocalController:
    planner = TaskPlanner(make_coat(CoatParameters(), 0.06), TaskParameters())
    return LocalController(planner, LocalParameters())


def simulator(
    controller: LocalController, feedback: bool = True, in_worker: bool = False
) -> tuple[LocalCompensation, Simulator, list[LocalProblem]]:
    """Returns a simulator of the system alone: a coat behind a person, and a plan to rest."""
    problems: list[LocalProblem] = []
    system = LocalCompensation(controller, PERIOD, DELAY, 0.2, 5, feedback, problems, in_worker)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    mesh = controller.planner.mesh
    x = mesh.rest_position + [-0.5, 0.0, 1.4]
    armholes = np.stack([sleeve.p_c for sleeve in controller.planner.sleeves(x)])
    joints = np.vstack(
        [arm_points(BodyMeasures(), "standing", s, ArmPose(0.3, 0.8, 0.0, 0.2)) for s in SIDES]
    )
    given = Assignment((Task.PREPARE, Task.PREPARE), (OFF, OFF))
    plan = GlobalPlan(0.0, 0.1, np.zeros((8, 2, 3)), np.tile(armholes, (9, 1, 1)), given)
    system.GetInputPort("plan").FixValue(context, Value(plan))
    system.GetInputPort("garment_position").FixValue(context, x.ravel())
    system.GetInputPort("predicted_joint_position").FixValue(context, np.tile(joints.ravel(), 6))
    for side in SIDES:
        held = x[mesh.grasp[side]].mean(axis=0)
        system.GetInputPort(f"{side}_gripper_position").FixValue(context, held)
    simulator.Initialize()
    return system, simulator, problems


def asked(system: LocalCompensation, simulator: Simulator) -> np.ndarray:
    context = simulator.get_context()
    return np.stack(
        [system.GetOutputPort(f"{side}_velocity_request").Eval(context) for side in SIDES]
    )


@pytest.mark.parametrize("in_worker", [False, True])
def test_a_solution_is_used_after_its_delay_and_says_when_it_was_seen(
    controller: LocalController, in_worker: bool
) -> None:
    system, sim, problems = simulator(controller, in_worker=in_worker)
    sim.AdvanceTo(0.9 * DELAY)
    assert in_worker or len(problems) == 1
    np.testing.assert_array_equal(asked(system, sim), 0.0)
    sim.AdvanceTo(1.1 * DELAY)
    assert np.linalg.norm(asked(system, sim), axis=1).min() > 0.01
    context = sim.get_context()
    assert system.GetOutputPort("request_time").Eval(context) == [0.0]
    sim.AdvanceTo(PERIOD + 1.1 * DELAY)
    assert system.GetOutputPort("request_time").Eval(context) == pytest.approx([PERIOD])


def test_it_solves_at_its_rate_and_tells_how_long_it_took(controller: LocalController) -> None:
    system, sim, problems = simulator(controller)
    sim.AdvanceTo(1.0 - 1e-6)
    assert len(problems) == round(1.0 / PERIOD)
    spent, count = system.GetOutputPort("solve_time").Eval(sim.get_context())
    assert count == len(problems)
    assert 0.0 < spent < 1.0


def test_the_same_twice_is_the_same_also_on_a_thread(controller: LocalController) -> None:
    runs = []
    for in_worker in (False, True):
        system, sim, _ = simulator(controller, in_worker=in_worker)
        sim.AdvanceTo(0.1)
        runs.append(asked(system, sim))
    np.testing.assert_array_equal(runs[0], runs[1])


def test_between_solves_it_answers_to_where_grippers_are(controller: LocalController) -> None:
    changed = []
    for feedback in (True, False):
        system, sim, _ = simulator(controller, feedback)
        sim.AdvanceTo(1.5 * DELAY)
        before = asked(system, sim)
        context = sim.get_mutable_context()
        port = system.GetInputPort("garment_position")
        port.FixValue(context, port.Eval(context) - 0.005)
        changed.append(np.abs(asked(system, sim) - before).max())
    assert changed[0] > 1e-3
    assert changed[1] == 0.0


def test_a_delay_of_a_period_or_more_is_refused(controller: LocalController) -> None:
    with pytest.raises(ValueError, match="delay"):
        LocalCompensation(controller, PERIOD, PERIOD, 0.2, 5)


def test_solves_in_two_contexts_do_not_know_of_each_other(controller: LocalController) -> None:
    """Also while they are under way on the thread, and in a copy of a context."""
    system, first, _ = simulator(controller, in_worker=True)
    second = Simulator(system, first.get_context().Clone())
    port = system.GetInputPort("garment_position")
    moved = port.Eval(second.get_context()) + 0.01
    port.FixValue(second.get_mutable_context(), moved)
    second.Initialize()

    def go_on(*simulators: Simulator) -> list[np.ndarray]:
        seen = []
        # ends within solves and between them
        for k in range(1, 12):
            for sim in simulators:
                sim.AdvanceTo(0.5 * k * DELAY)
                seen.append(asked(system, sim))
        return seen

    in_turn = go_on(first, second)
    alone = []
    for offset in (0.0, 0.01):
        other, sim, _ = simulator(controller, in_worker=True)
        where = other.GetInputPort("garment_position")
        context = sim.get_mutable_context()
        where.FixValue(context, where.Eval(context) + offset)
        sim.Initialize()
        found = []
        for k in range(1, 12):
            sim.AdvanceTo(0.5 * k * DELAY)
            found.append(asked(other, sim))
        alone.append(found)
    np.testing.assert_array_equal(in_turn[0::2], alone[0])
    np.testing.assert_array_equal(in_turn[1::2], alone[1])
    assert not np.array_equal(in_turn[0::2], in_turn[1::2])
