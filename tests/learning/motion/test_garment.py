"""Sleeves move as the garment allows, and arms carry them."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.learning.motion.garment import STEP, ArmAxes, Sleeves, axes_of
from drake_dress.learning.motion.garment_draw import GarmentDraw
from drake_dress.learning.motion.goals import Goal
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.geodesics import Reach
from drake_dress.models.human.arm import Arm
from drake_dress.models.human.body import BodyMeasures
from tests.learning.motion.persons import HOME

REACH = Reach(0.45, (0.5, 0.5), (0.12, 0.12), 0.5)
ARMS = [Arm(BodyMeasures(), "standing", side) for side in ("left", "right")]
NOBODY = np.zeros(2, dtype=bool)


def joints(angles: FloatArray = HOME) -> FloatArray:
    return np.concatenate([arm.points(angles) for arm in ARMS])


def axes(angles: FloatArray = HOME) -> ArmAxes:
    return axes_of(joints(angles))


def sleeves(
    seed: int,
    on: tuple[bool, bool] | None = None,
    across: float = 1.0,
    sways: float = 0.2,
    hinders: float = STEP,
) -> Sleeves:
    """Returns sleeves in a phase in which these arms are in their sleeves."""
    for attempt in range(seed, seed + 1000, 50):
        of = GarmentDraw(REACH, 0.15, 0.03, 0.5, 0.9, 0.2, across, 0.5, sways, hinders)
        drawn = Sleeves.drawn(np.random.default_rng(attempt), of, axes())
        if on is None or tuple(drawn.on) == on:
            return drawn
    raise AssertionError


def beyond(of: Sleeves) -> FloatArray:
    """Returns the four distances that the local problem bounds, as shares of the reach."""
    (left, right), (left_gripper, right_gripper), r = of.center, of.gripper, of.of.reach
    ways = [left - right_gripper, right - left_gripper, left - right, left_gripper - right_gripper]
    largest = np.array([*r.to_far_gripper, r.between_sleeves, r.between_grippers])
    shares: FloatArray = np.linalg.norm(ways, axis=1) / largest
    return shares


@pytest.mark.parametrize("seed", range(6))
def test_distances_stay_within_the_garments_reach_or_come_back_to_it(seed: int) -> None:
    moving = sleeves(seed)
    for k in range(40):
        before = beyond(moving)
        moving.advance(axes(), NOBODY, k * STEP)
        # the bounds of the solver hold up to 0.2 %
        assert (beyond(moving) <= np.maximum(1.0, before) + 2e-3).all()
    # grippers that began too far apart have come back
    assert (beyond(moving) <= np.maximum(1.0, beyond(sleeves(seed)) - 0.1) + 2e-3).all()


@pytest.mark.parametrize("seed", range(3))
def test_sleeves_keep_the_speed_of_their_grippers(seed: int) -> None:
    moving = sleeves(seed)
    for k in range(20):
        gripper = moving.gripper.copy()
        way = moving.advance(axes(), NOBODY, k * STEP)
        fastest = moving.of.max_speed * STEP * 1.01
        assert (np.linalg.norm(way, axis=1) <= fastest).all()
        assert (np.linalg.norm(moving.gripper - gripper, axis=1) <= fastest).all()
        np.testing.assert_allclose(np.linalg.norm(moving.direction, axis=1), 1.0)


def test_a_sleeve_on_an_arm_that_moves_by_will_stays_near_its_axis() -> None:
    moving = sleeves(0, (True, True))
    moving.goals = [Goal("aside", moving.center[0] + [0.4, 0.0, 0.0], 99.0), None]
    free = sleeves(0, (True, True))
    free.goals = list(moving.goals)
    for k in range(15):
        moving.advance(axes(), np.array([True, True]), k * STEP)
        free.advance(axes(), NOBODY, k * STEP)
    axis = axes()[0]
    assert axis.coordinates(moving.center[0]).l < 0.05
    assert axis.coordinates(free.center[0]).l > 0.1


def test_a_sleeve_is_drawn_up_an_arm() -> None:
    moving = sleeves(0, (True, True))
    moving.progress[:] = 0.3
    moving.goals = [Goal("draw", moving.center[i], 99.0) for i in (0, 1)]
    before = moving.progress.copy()
    for k in range(30):
        moving.advance(axes(), NOBODY, k * STEP)
        moving.meet(axes(), axes())
    assert moving.on.all()
    assert (moving.progress > before + 0.2).all()


def test_an_arm_carries_its_sleeve() -> None:
    moving = sleeves(0, (True, True))
    moving.progress[:] = 0.3
    moving.center = np.stack([axis.G(0.3) for axis in axes()])
    after = axes(HOME + [0.6, -0.4, 0.0, 0.5])
    moving.meet(after, axes())
    for i in (0, 1):
        assert axes()[i].coordinates(moving.center[i]).l > 0.09
        assert after[i].coordinates(moving.center[i]).l <= 0.09 + 1e-6


def test_a_sleeve_goes_over_a_hand_that_is_in_it_and_comes_off_beyond_it() -> None:
    moving = sleeves(0, (False, False))
    hand, elbow = joints()[2], joints()[1]
    out = (hand - elbow) / np.linalg.norm(hand - elbow)
    moving.center[0] = hand + 0.04 * out
    moving.center[1] = joints()[5] + 0.2
    moving.meet(axes(), axes())
    assert moving.on.tolist() == [True, False]
    moving.center[0] = hand + 0.03 * out
    moving.meet(axes(), axes())
    assert moving.on[0]
    # between both bounds it stays what it was
    moving.center[0] = hand + 0.07 * out
    moving.meet(axes(), axes())
    assert moving.on[0]
    moving.center[0] = hand + 0.09 * out
    moving.meet(axes(), axes())
    assert not moving.on[0]
    moving.center[0] = hand + 0.07 * out
    moving.meet(axes(), axes())
    assert not moving.on[0]


def test_grippers_follow_a_sleeve_that_an_arm_carries_away() -> None:
    moving = sleeves(0)
    moving.center += [0.0, 0.0, -0.5]
    moving.meet(axes(), axes())
    off = np.linalg.norm(moving.gripper - moving.center, axis=1)
    assert (off <= 1.4 * 0.12 + 1e-12).all()


def test_sleeves_off_their_arms_set_off_sideways_from_the_coat() -> None:
    moving = sleeves(0, (False, False), across=1e3, sways=0.0)
    for k in range(30):
        moving.advance(axes(), NOBODY, k * STEP)
    gap = moving.center[1] - moving.center[0]
    across = gap / np.linalg.norm(gap)
    # the armhole is the sleeve's inner end; directions follow with a lag
    assert moving.direction[0] @ across > 0.98
    assert moving.direction[1] @ across < -0.98


def test_a_sleeve_on_its_arm_mostly_points_along_it() -> None:
    moving = sleeves(0, (True, True), sways=0.0)
    for i, axis in enumerate(axes()):
        assert moving.direction[i] @ axis.D(float(moving.progress[i])) > 0.7


def test_cloth_hinders_a_hand_for_a_while() -> None:
    waited = []
    for seed in range(40):
        moving = sleeves(seed, (False, False), hinders=1.0)
        moving.center[0] = joints()[2]
        for k in range(200):
            moving.meet(axes(), axes())
            if moving.on[0]:
                waited.append(STEP * k)
                break
    # exponential with mean 1 s: the mean of 40 is in this range but once in 10,000
    assert len(waited) == 40
    assert 0.45 < np.mean(waited) < 1.6
