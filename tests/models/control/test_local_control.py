"""The local controller: how it takes up a plan, what it leaves alone, and what it follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control import constrained_ddp
from drake_dress.models.control.local_control import (
    GlobalPlan,
    LocalController,
    LocalOutcome,
    LocalState,
    continued,
)
from drake_dress.models.control.local_model import LocalParameters
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.solution import Solution
from drake_dress.models.control.task_parameters import TaskParameters
from drake_dress.models.control.tasks import Assignment, TaskPlanner
from drake_dress.models.dressing.stages import SleeveFacts, Task
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.human.body import ArmPose, BodyMeasures, arm_points
from drake_dress.models.sides import SIDES

M = BodyMeasures()
P = LocalParameters()
JOINTS = np.vstack([arm_points(M, "standing", side, ArmPose(0.3, 0.8, 0.0, 0.2)) for side in SIDES])
STILL = np.stack([JOINTS] * 6)
OFF = SleeveFacts(linked=False, s=0.0, hand_distance=0.5, prepared_error=0.5, passed=0.0)


@pytest.fixture(scope="module")
def controller() -> LocalController:
    return LocalController(TaskPlanner(make_coat(CoatParameters(), 0.06), TaskParameters()), P)


def seen(controller: LocalController) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns garment, grippers and armholes of a coat that hangs behind the person."""
    mesh = controller.planner.mesh
    x = mesh.rest_position + [-0.5, 0.0, 1.4]
    grippers = np.stack([x[mesh.grasp[side]].mean(axis=0) for side in SIDES])
    armholes = np.stack([sleeve.p_c for sleeve in controller.planner.sleeves(x)])
    return x, grippers, armholes


def plan_of(controller: LocalController, velocity: np.ndarray, armholes: np.ndarray) -> GlobalPlan:
    """Returns a plan in which sleeves go with their grippers to where they are asked."""
    n = 8
    moved = 0.1 * np.arange(n + 1)[:, None, None] * velocity
    given = Assignment((Task.PREPARE, Task.PREPARE), (OFF, OFF))
    joints = np.stack([JOINTS] * (n + 1))
    return GlobalPlan(0.0, 0.1, np.tile(velocity, (n, 1, 1)), armholes + moved, given, joints)


def solve(
    controller: LocalController,
    plan: GlobalPlan,
    joints: FloatArray = STILL,
    shift: float | FloatArray = 0.0,
    time: float = 0.0,
) -> LocalOutcome:
    x, grippers, _ = seen(controller)
    return controller.solve(LocalState(), plan, x + shift, grippers + shift, joints, 0.2, time)


@pytest.mark.parametrize("time", [0.0, 0.5])
def test_a_plan_that_comes_true_is_followed_as_it_is(
    controller: LocalController, time: float
) -> None:
    """Later, too, when targets are no longer where they were: they follow sleeves."""
    velocity = np.array([[0.05, 0.01, 0.0], [0.05, 0.01, 0.0]])
    plan = plan_of(controller, velocity, seen(controller)[2])
    local = solve(controller, plan, shift=time * velocity[0], time=time).plan
    np.testing.assert_allclose(local.velocity, np.tile(velocity, (P.horizon, 1, 1)), atol=1e-6)


def test_a_sleeve_that_is_not_where_it_was_foreseen_is_brought_back(
    controller: LocalController,
) -> None:
    controller = replace(controller, parameters=replace(P, prepare_correction=1.0))
    plan = plan_of(controller, np.zeros((2, 3)), seen(controller)[2])
    ahead = np.array([0.0, 0.0, 0.02])
    outcome = solve(controller, plan, shift=ahead)
    first = outcome.plan.velocity[0]
    assert np.all(first[:, 2] < -0.01)
    np.testing.assert_allclose(first[:, :2], 0.0, atol=2e-3)
    np.testing.assert_allclose(
        outcome.plan.state[-1, :6].reshape(2, 3), plan.armhole[-1], atol=3e-3
    )


def test_it_goes_where_the_person_goes(controller: LocalController) -> None:
    """A person who has stepped aside since the plan was made is followed."""
    aside = np.array([0.0, 0.03, 0.0])
    plan = plan_of(controller, np.zeros((2, 3)), seen(controller)[2])
    moved = solve(controller, plan, joints=STILL + aside).plan
    assert np.all(moved.velocity[0][:, 1] > 0.01)


@pytest.mark.parametrize("linked", [False, True])
def test_an_arm_that_the_garment_drags_is_not_followed(
    controller: LocalController, linked: bool
) -> None:
    """But the person is, and what a hand does beyond that."""
    plan = plan_of(controller, np.zeros((2, 3)), seen(controller)[2])
    facts = (replace(OFF, linked=linked, s=0.3 * linked), OFF)
    tasks = (Task.WAIT if linked else Task.PREPARE, Task.PREPARE)
    plan = replace(plan, assignment=Assignment(tasks, facts))

    def first(joints: np.ndarray) -> np.ndarray:
        return solve(controller, plan, joints=joints).plan.velocity[0]

    pushed = STILL.copy()
    pushed[:, 2] += [0.0, 0.0, 0.03]
    np.testing.assert_allclose(first(pushed), 0.0, atol=1e-6)
    waved = STILL.copy()
    waved[:, 2] += [0.0, 0.0, 0.09]
    if linked:
        np.testing.assert_allclose(first(waved), 0.0, atol=1e-6)
    else:
        assert first(waved)[0, 2] > 0.05
    stepped = pushed + [0.0, 0.0, 0.03]
    assert first(stepped)[0, 2] > 0.01


def test_a_plan_is_cut_off_at_its_front_and_goes_on_at_its_end() -> None:
    rng = np.random.default_rng(0)
    velocity = rng.normal(0.0, 0.05, (8, 2, 3))
    armhole = np.concatenate([np.zeros((1, 2, 3)), np.cumsum(0.1 * velocity, axis=0)])
    plan = GlobalPlan(2.0, 0.1, velocity, armhole)
    here = np.ones((2, 3))
    nominal, foreseen = continued(plan, here, 2.0 * here, 2.3, P)
    np.testing.assert_allclose(nominal.velocity[:2], np.tile(velocity[3], (2, 1, 1)))
    np.testing.assert_allclose(nominal.velocity[-1], velocity[-1])
    np.testing.assert_allclose(nominal.sleeve[0], here)
    np.testing.assert_allclose(nominal.gripper[0], 2.0 * here)
    np.testing.assert_allclose(foreseen[0], armhole[3])
    # sleeves of this plan go with their grippers, to its end and beyond
    np.testing.assert_allclose(
        nominal.sleeve - nominal.sleeve[0], nominal.gripper - nominal.gripper[0], atol=1e-12
    )


def test_without_anything_planned_it_rests(controller: LocalController) -> None:
    plan = GlobalPlan(0.0, 0.1, np.zeros((8, 2, 3)), np.zeros((9, 2, 3)))
    outcome = solve(controller, plan)
    assert outcome.problem is None
    np.testing.assert_array_equal(outcome.plan.velocity_at(0.0), 0.0)


def test_left_to_itself_it_goes_for_the_targets(controller: LocalController) -> None:
    x, _, armholes = seen(controller)
    given = Assignment((Task.PREPARE, Task.REST), (OFF, OFF))
    plan = GlobalPlan(0.0, 0.1, np.zeros((8, 2, 3)), np.tile(armholes, (9, 1, 1)), given)
    local = solve(controller, plan).plan
    asked = controller.planner.targets(given, controller.planner.sleeves(x), STILL, 0.2)[0]
    way = asked.position[0] - armholes[0]
    along = local.velocity[0, 0] @ way / np.linalg.norm(way)
    assert along == pytest.approx(P.max_speed, rel=1e-3)
    # the other gripper rests, but for what the garment between them needs
    apart = np.linalg.norm(local.state[:, 6:9] - local.state[:, 9:], axis=1)
    assert apart.max() <= max(controller.reach.between_grippers, apart[0]) + 1e-6
    assert np.linalg.norm(local.velocity[0, 1]) < 0.5 * P.max_speed


@pytest.mark.parametrize("stretch", [0.8, 0.9])
def test_a_garment_drawn_wider_than_asked_is_let_together(
    controller: LocalController, stretch: float
) -> None:
    controller = replace(controller, parameters=replace(P, stretch=stretch))
    _, _, armholes = seen(controller)
    given = Assignment((Task.PREPARE, Task.REST), (OFF, OFF))
    plan = GlobalPlan(0.0, 0.1, np.zeros((8, 2, 3)), np.tile(armholes, (9, 1, 1)), given)
    local = solve(controller, plan).plan
    apart = np.linalg.norm(local.state[:, 6:9] - local.state[:, 9:], axis=1)
    allowed = stretch * controller.reach.between_grippers
    assert apart[0] > allowed
    time = P.time_step * np.arange(len(apart))
    assert (apart <= np.maximum(allowed, apart[0] - P.return_speed * time) + 1e-6).all()


def test_gains_ask_for_no_more_than_to_be_back_in_a_step(controller: LocalController) -> None:
    def opposed(problem: LocalProblem, before: Solution | None) -> Solution:
        # the bound on one gripper's speed as active as that on where it is
        found = constrained_ddp.solve(problem, before)
        both = np.full_like(found.state_multiplier, 1e3), np.full_like(found.input_multiplier, 1e3)
        return replace(found, state_multiplier=both[0], input_multiplier=both[1])

    controller = replace(controller, solver=opposed)
    local = solve(controller, plan_of(controller, np.zeros((2, 3)), seen(controller)[2])).plan
    assert np.isfinite(local.gain).all()
    assert np.linalg.norm(local.gain, ord=2, axis=(1, 2)).max() <= 1.0 / P.time_step + 1e-9


def test_between_solves_the_gains_correct_and_speed_stays_bounded(
    controller: LocalController,
) -> None:
    plan = plan_of(controller, np.zeros((2, 3)), seen(controller)[2])
    local = solve(controller, plan).plan
    foreseen = local.state[0]
    np.testing.assert_allclose(local.velocity_at(0.0, foreseen), local.velocity[0])
    off = foreseen.copy()
    off[2] += 0.01
    changed = local.velocity_at(0.0, off) - local.velocity[0]
    assert changed[0, 2] < 0.0
    off[2] += 10.0
    assert np.linalg.norm(local.velocity_at(0.0, off), axis=1).max() <= P.max_speed * (1 + 1e-12)
    np.testing.assert_array_equal(local.velocity_at(100.0, foreseen), 0.0)
