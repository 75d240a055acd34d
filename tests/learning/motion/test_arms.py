"""An arm follows what leads it within its limits, and moves where its will has it go."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.learning.motion.arms import Following
from drake_dress.learning.motion.movements import Movement
from drake_dress.learning.motion.strokes import Stroke
from drake_dress.models.dressing.coordinates import ArmAxis
from tests.learning.motion.persons import ARM, HOME, LIMITS, moving_arm

STEP = 0.05


def axis_of(angles: np.ndarray) -> ArmAxis:
    shoulder, elbow, hand = ARM.points(angles)
    return ArmAxis(hand, elbow, shoulder)


@pytest.mark.parametrize("progress", [0.1, 0.9, 1.4])
@pytest.mark.parametrize("seed", range(4))
def test_a_led_arm_comes_within_the_clearance(progress: float, seed: int) -> None:
    rng, arm = np.random.default_rng(seed), moving_arm(clearance=0.03)
    # an armhole that the arm can come to: on the axis in a pose nearby
    pose = np.clip(HOME + 0.25 * rng.normal(size=4), *LIMITS)
    center = axis_of(pose).G(progress)
    for _ in range(200):
        axis = axis_of(arm.angles)
        s = axis.coordinates(center).s
        off = center - axis.G(s)
        size = float(np.linalg.norm(off))
        arm.follow(off * max(0.0, size - arm.following.clearance) / max(size, 1e-9), s, STEP)
    assert axis_of(arm.angles).coordinates(center).l < 0.032
    # nothing leads it any more: it stays
    before = arm.angles.copy()
    for _ in range(40):
        arm.follow(None, 0.0, STEP)
    assert np.abs(arm.angles - before).max() < 0.05


def test_an_arm_that_springs_back_does_so_when_it_is_let_go() -> None:
    arm = moving_arm(returning=0.5)
    for _ in range(20):
        arm.follow(np.array([0.1, 0.1, 0.0]), 0.0, STEP)
    assert np.linalg.norm(arm.hand - ARM.hand(HOME)) > 0.05
    for _ in range(100):
        arm.follow(None, 0.0, STEP)
    assert np.linalg.norm(arm.hand - ARM.hand(HOME)) < 1e-3


def test_limits_hold_however_an_arm_is_led() -> None:
    rng, arm = np.random.default_rng(0), moving_arm(lag=0.05)
    reached = np.zeros((2, 4), dtype=bool)
    for k in range(1500):
        if k % 30 == 0:
            led, progress = rng.normal(size=3), rng.uniform(0.0, 2.0)
        before = arm.angles.copy()
        arm.follow(led, progress, STEP)
        assert (arm.angles >= LIMITS[0]).all()
        assert (arm.angles <= LIMITS[1]).all()
        assert np.abs(arm.angles - before).max() <= 1.2 * STEP + 1e-12
        reached |= arm.angles == LIMITS
    assert reached.any()


def test_the_least_effort_spares_the_joint_that_is_hard_to_move() -> None:
    easy, stiff = moving_arm(), moving_arm()
    stiff.effort = np.array([1.0, 50.0, 0.6, 0.4])
    for arm in (easy, stiff):
        arm.follow(np.array([0.005, 0.0, 0.0]), 0.0, STEP)
    assert abs(stiff.rate[1]) < 0.5 * abs(easy.rate[1])


def test_a_hand_goes_where_its_will_has_it_go() -> None:
    arm = moving_arm()
    start = arm.hand
    way = np.array([0.15, 0.1, 0.1])
    assert not arm.is_willed(0.0)
    arm.movement = Movement(start, (Stroke(0.0, 1.2, way, np.zeros(3)),))
    for k in range(24):
        time = k * STEP
        assert arm.is_willed(time)
        arm.move_by_will(time, STEP)
        np.testing.assert_allclose(arm.hand, arm.movement.position(time + STEP), atol=0.01)
    assert not arm.is_willed(1.2)
    np.testing.assert_allclose(arm.hand, start + way, atol=0.005)


def test_limits_and_speeds_hold_for_a_target_out_of_reach() -> None:
    arm = moving_arm()
    arm.movement = Movement(arm.hand, (Stroke(0.0, 0.5, np.array([1.5, 1.5, 1.5]), np.zeros(3)),))
    for k in range(40):
        before = arm.angles.copy()
        arm.move_by_will(k * STEP, STEP)
        assert (arm.angles >= LIMITS[0]).all()
        assert (arm.angles <= LIMITS[1]).all()
        assert np.abs(arm.angles - before).max() <= 6.0 * STEP + 1e-12


def test_some_arms_stay_and_others_return() -> None:
    drawn = [Following.drawn(np.random.default_rng(s), 0.03) for s in range(60)]
    stay = sum(f.stays for f in drawn)
    soon = sum(f.returning <= 2.0 for f in drawn)
    # a third of 60 each; outside this range once in 10,000 seeds
    assert 7 <= stay <= 35
    assert 7 <= soon <= 35
    assert all(0.05 <= f.lag <= 0.5 and 0.0 <= f.drag <= 0.5 for f in drawn)


def test_an_arm_without_a_movement_cannot_move_by_will() -> None:
    with pytest.raises(ValueError, match="no movement"):
        moving_arm().move_by_will(0.0, STEP)
