"""Joints that stay within their bounds exceed no limit, ever."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arm.chain import JointLimits
from drake_dress.models.arm.joint_bounds import rate_bounds
from drake_dress.models.arm.panda import LIMITS

STEP = 0.005


@given(seed=st.integers(0, 2**31), step=st.floats(1e-3, 0.02))
@settings(max_examples=30)
def test_whatever_is_chosen_no_limit_is_exceeded(seed: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    q = rng.uniform(LIMITS.lower, LIMITS.upper)
    rate = np.zeros(7)
    for _ in range(400):
        low, high = rate_bounds(q, rate, step, LIMITS)
        assert (low <= high).all()
        # at the ends of what is allowed more often than between
        chosen = np.clip(rng.uniform(-1.0, 2.0, 7), 0.0, 1.0)
        new = low + chosen * (high - low)
        assert (np.abs(new - rate) <= LIMITS.acceleration * step * (1.0 + 1e-9)).all()
        assert (np.abs(new) <= LIMITS.speed * (1.0 + 1e-9)).all()
        q, rate = q + step * new, new
        assert (q <= LIMITS.upper + 1e-9).all()
        assert (q >= LIMITS.lower - 1e-9).all()


def test_full_speed_is_braked_just_in_time() -> None:
    q, rate = np.zeros(7), np.zeros(7)
    fastest = np.zeros(7)
    for _ in range(2000):
        _, rate = rate_bounds(q, rate, STEP, LIMITS)
        fastest = np.maximum(fastest, rate)
        q = q + STEP * rate
    away = LIMITS.upper > 0.5
    np.testing.assert_allclose(fastest[away], LIMITS.speed[away])
    np.testing.assert_allclose(q[away], LIMITS.upper[away], atol=1e-6)


def test_a_joint_beyond_its_limit_brakes_and_comes_back_no_faster_than_it_may() -> None:
    limits = JointLimits(*(np.array([v]) for v in (-1.0, 1.0, 2.0, 5.0, 10.0)))
    low, high = rate_bounds(np.array([1.1]), np.array([1.0]), STEP, limits)
    np.testing.assert_allclose(high, 1.0 - 5.0 * STEP)
    np.testing.assert_allclose(low, high)
    low, high = rate_bounds(np.array([1.1]), np.array([0.0]), STEP, limits)
    assert high <= 0.0
    assert low < 0.0
