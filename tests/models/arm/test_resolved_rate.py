"""Two arms move their grippers as asked, and keep every limit and distance doing so."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arm.clearance import Capsules, clearance
from drake_dress.models.arm.panda import LIMITS, SHAPE, panda
from drake_dress.models.arm.resolved_rate import ArmPair, GripperGoal, RateParameters

STEP = 0.005
HOME = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8])


def standing(x: float, y: float) -> np.ndarray:
    base = np.eye(4)
    base[:3, 3] = x, y, 0.7
    return base


def pair(apart: float = 0.9, **settings: float) -> ArmPair:
    arms = panda(standing(0.0, 0.5 * apart)), panda(standing(0.0, -0.5 * apart))
    return ArmPair(
        arms, (SHAPE, SHAPE), np.stack([HOME, HOME]), parameters=RateParameters(**settings)
    )


def goals(arms: ArmPair, q: np.ndarray, velocity: np.ndarray) -> tuple[GripperGoal, GripperGoal]:
    """Asks grippers to be where they are, with velocities (2,3), hands as they are."""
    tools = [arm.links(q[i])[-1] for i, arm in enumerate(arms.arms)]
    left, right = (
        GripperGoal(tool[:3, 3], v, tool[:3, :3]) for tool, v in zip(tools, velocity, strict=True)
    )
    return left, right


@given(seed=st.integers(0, 2**31))
@settings(max_examples=30)
def test_grippers_go_exactly_where_they_are_asked(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arms = pair()
    q = HOME + rng.uniform(-0.2, 0.2, (2, 7))
    velocity = rng.uniform(-0.1, 0.1, (2, 3))
    rate, asked = np.zeros((2, 7)), goals(arms, q, velocity)
    for _ in range(12):
        found = arms.rates(q, rate, asked, STEP)
        rate = found.rate
        assert found.kept
    for i, arm in enumerate(arms.arms):
        moved = arm.tool_jacobian(arm.links(q[i])) @ rate[i]
        np.testing.assert_allclose(moved[:3], found.share[i] * velocity[i], atol=1e-7)
    np.testing.assert_allclose(found.share, 1.0, atol=0.05)


@given(seed=st.integers(0, 2**31))
@settings(max_examples=8)
def test_no_limit_is_exceeded_whatever_is_asked(seed: int) -> None:
    """Goals that jump, far outside of what arms reach, through each other."""
    rng = np.random.default_rng(seed)
    arms = pair(rng.uniform(0.5, 1.2))
    q, rate = np.tile(HOME, (2, 1)), np.zeros((2, 7))
    for k in range(300):
        if k % 60 == 0:
            places = rng.uniform([-1.0, -1.2, 0.2], [1.2, 1.2, 2.0], (2, 3))
            turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            turned *= np.linalg.det(turned)
        left, right = (GripperGoal(p, np.zeros(3), turned) for p in places)
        found = arms.rates(q, rate, (left, right), STEP)
        assert (np.abs(found.rate) <= LIMITS.speed * (1 + 1e-9)).all()
        assert (np.abs(found.rate - rate) <= LIMITS.acceleration * STEP * (1 + 1e-6)).all()
        rate = found.rate
        q = q + STEP * rate
        assert (q <= LIMITS.upper + 1e-9).all()
        assert (q >= LIMITS.lower - 1e-9).all()
        assert found.between_arms > 0.04


def test_arms_that_are_sent_at_each_other_stop_before_they_meet() -> None:
    arms = pair(0.6)
    q, rate = np.tile(HOME, (2, 1)), np.zeros((2, 7))
    middle = 0.5 * (arms.arms[0].tool_position(q[0]) + arms.arms[1].tool_position(q[1]))
    least = np.inf
    turned = arms.arms[0].links(q[0])[-1, :3, :3]
    for _ in range(1200):
        asked = GripperGoal(middle, np.zeros(3), turned)
        found = arms.rates(q, rate, (asked, asked), STEP)
        rate, q = found.rate, q + STEP * found.rate
        least = min(least, found.between_arms)
    assert 0.045 < least < 0.08


def test_an_arm_keeps_away_from_a_person_but_its_hand_need_not() -> None:
    arms = pair()
    q, rate = np.tile(HOME, (2, 1)), np.zeros((2, 7))
    start = arms.arms[0].tool_position(q[0])
    turned = arms.arms[0].links(q[0])[-1, :3, :3]
    # someone's arm, held across the way of the elbow
    person = Capsules(
        np.array([[0.55, -0.2, 1.25]]), np.array([[0.55, 0.9, 1.25]]), np.array([0.05])
    )
    least = np.inf
    for _ in range(1500):
        ahead = GripperGoal(start + [0.25, 0.0, -0.1], np.zeros(3), turned)
        still = GripperGoal(arms.arms[1].tool_position(np.asarray(HOME)), np.zeros(3), turned)
        found = arms.rates(q, rate, (ahead, still), STEP, person)
        rate, q = found.rate, q + STEP * found.rate
        least = min(least, found.to_person[0])
    assert least > 0.045


def test_what_is_out_of_reach_slows_grippers_not_joints_down() -> None:
    arms = pair()
    q, rate = np.tile(HOME, (2, 1)), np.zeros((2, 7))
    turned = arms.arms[0].links(q[0])[-1, :3, :3]
    far = GripperGoal(np.array([1.5, 0.45, 1.2]), np.zeros(3), turned)
    still = goals(arms, q, np.zeros((2, 3)))[1]
    for _ in range(2000):
        found = arms.rates(q, rate, (far, still), STEP)
        rate, q = found.rate, q + STEP * found.rate
        assert np.abs(rate).max() < 2.2
    assert np.abs(rate[0]).max() < 0.05
    reached = arms.arms[0].tool_position(q[0])
    assert np.linalg.norm(reached - arms.arms[0].links(q[0])[3, :3, 3]) > 0.4


def test_elbows_go_outward_while_grippers_stay() -> None:
    arms = pair(0.6, home_gain=0.0, outward_gain=0.5)
    q, rate = np.tile(HOME, (2, 1)), np.zeros((2, 7))
    asked = goals(arms, q, np.zeros((2, 3)))

    def apart(q: np.ndarray) -> float:
        third = [arm.links(q[i])[3, :3, 3] for i, arm in enumerate(arms.arms)]
        return float(np.linalg.norm(third[0] - third[1]))

    before = apart(q)
    for _ in range(600):
        found = arms.rates(q, rate, asked, STEP)
        rate, q = found.rate, q + STEP * found.rate
    assert apart(q) > before + 0.01
    for i, arm in enumerate(arms.arms):
        np.testing.assert_allclose(arm.tool_position(q[i]), asked[i].position, atol=1e-3)


def test_a_hand_turns_as_it_is_asked() -> None:
    arms = pair()
    q, rate = np.tile(HOME, (2, 1)), np.zeros((2, 7))
    left, right = goals(arms, q, np.zeros((2, 3)))
    c, s = np.cos(0.4), np.sin(0.4)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ left.rotation
    left = replace(left, rotation=turned)
    for _ in range(1500):
        found = arms.rates(q, rate, (left, right), STEP)
        rate, q = found.rate, q + STEP * found.rate
    now = arms.arms[0].links(q[0])[-1, :3, :3]
    assert np.arccos(np.clip(0.5 * (np.trace(now.T @ turned) - 1.0), -1.0, 1.0)) < 0.1
    assert np.trace(now.T @ turned) == pytest.approx(3.0, abs=0.02)


@given(seed=st.integers(0, 2**31))
@settings(max_examples=10)
def test_distance_to_a_tapered_person_is_that_of_its_round_cones(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arms = pair()
    q = HOME + rng.uniform(-0.2, 0.2, (2, 7))
    still = goals(arms, q, np.zeros((2, 3)))
    first, second = rng.uniform([0.4, -0.6, 0.6], [1.2, 0.6, 1.6], (2, 5, 3))
    radii = rng.uniform(0.03, 0.12, (5, 2))
    pairs = np.array([[i, j] for i in np.flatnonzero(SHAPE.link <= 5) for j in range(5)])
    for given_radii in (radii, radii[:, 0], np.stack([radii[:, 0]] * 2, axis=1)):
        person = Capsules(first, second, given_radii)
        found = arms.rates(q, np.zeros((2, 7)), still, STEP, person)
        for i, arm in enumerate(arms.arms):
            placed = SHAPE.placed(arm.links(q[i]))
            least = clearance(placed, person, pairs).distance.min()
            assert found.to_person[i] == pytest.approx(least, abs=1e-12)
