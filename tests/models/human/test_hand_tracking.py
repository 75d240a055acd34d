"""Paths of the hand are those that people make; joints follow them within their limits."""

import numpy as np
import pytest

from drake_dress.models.human.arm import Arm
from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.human.hand_tracking import (
    HandPath,
    eased,
    planned_time,
    rate_bounds,
    tracking_rate,
)
from drake_dress.models.human.motions import minimum_jerk

ARM = Arm(BodyMeasures(), "standing", "left")
REST = np.deg2rad([13.0, 46.0, 0.0, 10.0])
LIMITS = np.array([[-0.6, -2.6, -1.2, 0.0], [2.6, 1.2, 1.2, 2.5]])
SPEED, STEP = 0.5, 0.004


def bounds(angles: np.ndarray) -> np.ndarray:
    return rate_bounds(angles, LIMITS, 2.0)


def at_rest(position: np.ndarray, duration: float) -> HandPath:
    return HandPath(position, np.zeros(3), np.zeros(3), duration)


def test_path_to_a_target_at_rest_is_the_minimum_jerk_path() -> None:
    target, step = np.array([0.3, -0.1, 0.2]), 0.0005
    duration = planned_time(float(np.linalg.norm(target)), SPEED)
    path, fastest = at_rest(np.zeros(3), duration), 0.0
    for k in range(1, int((duration - 0.35) / step)):
        path = path.toward(target, SPEED, step)
        fastest = max(fastest, float(np.linalg.norm(path.velocity)))
        expected = minimum_jerk(k * step / duration)[0] * target
        np.testing.assert_allclose(path.position, expected, atol=0.004)
    assert fastest == pytest.approx(SPEED, rel=0.03)


def test_path_arrives_and_stays() -> None:
    target, path = np.array([0.0, 0.2, 0.1]), at_rest(np.zeros(3), 1.0)
    for _ in range(750):
        path = path.toward(target, SPEED, STEP)
    np.testing.assert_allclose(path.position, target, atol=1e-4)
    assert np.linalg.norm(path.velocity) < 1e-3


def test_path_after_a_target_that_leaps_is_bounded_in_speed() -> None:
    rng, path = np.random.default_rng(0), at_rest(np.zeros(3), 0.5)
    for k in range(2000):
        if k % 50 == 0:
            target = rng.uniform(-1.0, 1.0, 3)
        after = path.toward(target, SPEED, STEP)
        assert np.linalg.norm(after.velocity) <= SPEED + 1e-12
        np.testing.assert_allclose(after.position, path.position + STEP * after.velocity)
        path = after


def test_joints_carry_the_hand_to_where_it_shall_be() -> None:
    angles, goal = REST.copy(), ARM.hand(REST) + [-0.05, 0.12, 0.10]
    path = at_rest(ARM.hand(REST), 1.0)
    for _ in range(1000):
        path = path.toward(goal, SPEED, STEP)
        angles = angles + STEP * tracking_rate(
            ARM, angles, path.position, path.velocity, REST, bounds(angles), SPEED
        )
    assert np.linalg.norm(ARM.hand(angles) - goal) < 0.005


def test_hinges_at_their_limit_are_not_driven_outward() -> None:
    angles = np.array([0.2, 1.2, 0.0, 0.0])
    backward = ARM.hand(angles) + [-0.3, 0.0, 0.3]
    rate = tracking_rate(ARM, angles, backward, np.zeros(3), REST, bounds(angles), SPEED)
    assert rate[1] <= 1e-12
    assert rate[3] >= -1e-12
    assert np.abs(rate).max() > 0.1


def test_hand_and_joints_keep_their_speeds_wherever_the_hand_is_sent() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        angles = rng.uniform(*LIMITS)
        allowed = bounds(angles)
        rate = tracking_rate(
            ARM, angles, rng.uniform(-2.0, 2.0, 3), np.zeros(3), REST, allowed, SPEED
        )
        assert (rate >= allowed[0] - 1e-12).all()
        assert (rate <= allowed[1] + 1e-12).all()
        assert np.linalg.norm(ARM.jacobian(angles) @ rate) <= SPEED + 1e-9


def test_a_joint_at_its_greatest_rate_comes_to_rest_at_its_limit() -> None:
    angles, rate = REST.copy(), np.zeros(4)
    for _ in range(1500):
        after = eased(bounds(angles)[0], rate, STEP)
        assert np.abs(after - rate).max() <= 30.0 * STEP + 1e-12
        angles, rate = angles + STEP * after, after
        assert (angles >= LIMITS[0] - 1e-3).all()
    np.testing.assert_allclose(angles, LIMITS[0], atol=1e-2)


def test_rates_change_in_proportion() -> None:
    rate, wanted = np.zeros(4), np.array([2.0, -1.0, 0.0, 0.5])
    after = eased(wanted, rate, STEP)
    np.testing.assert_allclose(after, 0.06 * wanted)
    np.testing.assert_array_equal(eased(wanted, wanted + 0.01, STEP), wanted)
