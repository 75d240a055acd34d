"""What is on its way when a plan is made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.cloth.material import Material
from drake_dress.models.control.policy import DressingPolicy, PolicyParameters, later
from drake_dress.models.control.situation import Situation
from drake_dress.models.dressing.stages import StageState
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.garment.hold import held_at_edges
from drake_dress.models.garment.mesh import Hold
from drake_dress.models.human.body import (
    ArmPose,
)
from tests.plain_person import plain_joints, plain_person

PERSON = plain_person("standing")
POSE = ArmPose(0.25, 0.8, 0.0, 0.2)
JOINTS = plain_joints("standing", POSE)


@given(st.integers(1, 8), st.floats(0.0, 12.0), st.integers(0, 2**32 - 1))
def test_grippers_go_as_far_as_the_plan_before_leads_them(n: int, steps: float, seed: int) -> None:
    """The way in each step is the integral of the velocity that the plan before has meanwhile."""
    velocity = np.random.default_rng(seed).normal(size=(n, 2, 3))
    ends = np.concatenate([np.zeros((1, 2, 3)), np.cumsum(velocity, axis=0)])

    def gone(at: float) -> np.ndarray:
        if at >= n:
            return ends[n] + (at - n) * velocity[-1]
        whole = int(at)
        return ends[whole] + (at - whole) * velocity[whole]

    found = later(velocity, steps)
    assert found.shape == velocity.shape
    for j in range(n):
        assert found[j] == pytest.approx(gone(steps + j + 1) - gone(steps + j), abs=1e-7)


def test_whole_steps_are_taken_as_they_are() -> None:
    """Also where a quotient of times is not quite the whole number that it should be."""
    velocity = np.arange(5.0)[:, None]
    for steps in (2.0, 0.6 / 0.3, 2.0 - 1e-12, 2.0 + 1e-16):
        assert np.array_equal(later(velocity, steps)[:, 0], [2.0, 3.0, 4.0, 4.0, 4.0])


def distance_after_a_step(share: float, radius: float | None) -> tuple[float, np.ndarray]:
    """Returns the left gripper's distance from the hand after a step of a plan, m, and the plan.

    It begins beside the hand, and its sleeve is to come nearer.
    """
    mesh = make_coat(CoatParameters(), 0.06)
    parameters = PolicyParameters(
        horizon=3, max_iterations=6, committed_steps=0, spread_share=share
    )
    policy = DressingPolicy(mesh, Material(), PERSON, parameters)
    held = mesh.rest_position[mesh.grasp["left"]].mean(axis=0)
    begin = JOINTS[2] + [0.0, 0.15, 0.0]
    x = mesh.rest_position + begin - held
    rows = np.tile(JOINTS, (4, 1, 1))
    spread = None if radius is None else np.full((4, 6), radius)
    _, decision = policy.decide(
        policy.initial_state(), x, np.zeros_like(x), rows, 0.0, radius=spread
    )
    velocity = decision.plan.velocity
    after = begin + parameters.time_step * velocity[0, 0]
    return float(np.linalg.norm(after - JOINTS[2])), velocity


def test_grippers_keep_further_away_from_a_person_who_is_less_certain() -> None:
    certain, plan = distance_after_a_step(0.5, None)
    for share, radius in ((0.5, 0.0), (0.0, 0.1)):
        np.testing.assert_array_equal(distance_after_a_step(share, radius)[1], plan)
    less, least = (distance_after_a_step(0.5, radius)[0] for radius in (0.1, 0.2))
    assert certain + 0.005 < less < least - 0.01


class _Seen(Exception):
    """Carries the situation that a plan was to be made for."""


@pytest.mark.parametrize("held", ["edges", "shoulders"])
@pytest.mark.parametrize("down", [True, False])
@pytest.mark.parametrize(("away", "missed"), [(0.1, 1), (0.8, 1), (0.1, 0)])
def test_the_collar_is_led_along_an_arm_that_hangs_and_was_missed(
    held: Hold, down: bool, away: float, missed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = make_coat(CoatParameters(), 0.06)
    if held == "edges":
        mesh = held_at_edges(mesh, 0.4, "test")
    policy = DressingPolicy(mesh, Material(), PERSON, PolicyParameters(horizon=3))

    def seen(situation: Situation, *others: object) -> None:
        raise _Seen(situation)

    monkeypatch.setattr(policy.controller, "solve", seen)
    pose = ArmPose(0.1, 0.1, 0.0, 0.1) if down else ArmPose(0.25, 0.8, 0.0, 0.1)
    joints = plain_joints("standing", pose)
    center = mesh.rest_position[policy.planner.armholes[0]].mean(axis=0)
    x = mesh.rest_position + joints[2] - [away, 0.0, 0.0] - center
    stages = StageState(attempts=(missed, missed), since=(-4.0, -4.0))
    state = replace(policy.initial_state(), stages=stages)
    with pytest.raises(_Seen) as raised:
        policy.decide(state, x, np.zeros_like(x), np.tile(joints, (4, 1, 1)), 0.0)
    situation: Situation = raised.value.args[0]
    if held == "shoulders" or not down or away > 0.5 or missed == 0:
        assert situation.leading is None
        return
    assert situation.leading is not None
    forearm = joints[1] - joints[2]
    forearm /= np.linalg.norm(forearm)
    way = situation.leading - situation.targets[0].position
    behind = policy.parameters.tasks.leading_behind
    along = way + behind * np.array([1.0, 0.0, 0.0])
    np.testing.assert_allclose(along - (along @ forearm)[:, None] * forearm, 0.0, atol=1e-9)
    # as far up the arm as the collar is from the armhole
    assert np.linalg.norm(along[0]) == pytest.approx(0.3, abs=0.08)
