"""Simple predictors: each is exact for the motion that it assumes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.learning.evaluation.baselines import (
    constant_velocity,
    damped_velocity,
    last_velocity,
    mean_of,
    plain_baselines,
    still,
)
from drake_dress.models.human.learned.forecast import PersonHistory
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD
from drake_dress.models.human.learned.ridge import RidgePredictor
from drake_dress.models.human.prediction import ConstantVelocityPredictor
from tests.models.human.learned.drawn import drawn_networks, drawn_scene

RIDGE = RidgePredictor(drawn_networks(0).linear)
ALL = plain_baselines(RIDGE)
AHEAD = PERIOD * np.arange(FUTURE + 1)[:, None, None]
seeds = st.integers(0, 2**32 - 1)


def history(joints: np.ndarray) -> PersonHistory:
    return PersonHistory(0.0, joints, np.full((HISTORY, 2, 6), np.nan))


def carried(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns the joints (T,6,3), m, of a person carried along, and the velocity (3,), m/s."""
    velocity = np.random.default_rng(seed).uniform(-0.4, 0.4, 3)
    times = PERIOD * np.arange(1 - HISTORY, 1)[:, None, None]
    return drawn_scene(seed, 1).joints[0] + times * velocity, velocity


@pytest.mark.parametrize("name", ALL)
@given(seed=seeds)
@settings(max_examples=10)
def test_who_is_at_rest_is_predicted_to_stay(name: str, seed: int) -> None:
    joints = np.tile(drawn_scene(seed, 1).joints[0], (HISTORY, 1, 1))
    found = ALL[name](history(joints))
    np.testing.assert_allclose(found, np.tile(joints[-1], (FUTURE + 1, 1, 1)), atol=1e-9)


@given(seeds)
@settings(max_examples=30)
def test_constant_velocity_has_no_error_of_a_motion_at_constant_velocity(seed: int) -> None:
    joints, velocity = carried(seed)
    true = joints[-1] + AHEAD * velocity
    for predict in (constant_velocity, last_velocity):
        np.testing.assert_allclose(predict(history(joints)), true, atol=1e-4)
    np.testing.assert_array_equal(still(history(joints)), np.tile(joints[-1], (FUTURE + 1, 1, 1)))


@given(seeds)
@settings(max_examples=30)
def test_damped_velocity_is_what_the_shipped_predictor_finds(seed: int) -> None:
    joints, velocity = carried(seed)
    tau = ConstantVelocityPredictor.decay_time
    expected = joints[-1] + tau * (1.0 - np.exp(-AHEAD / tau)) * velocity
    np.testing.assert_allclose(damped_velocity(history(joints)), expected, atol=1e-9)


def test_a_wrong_newest_sample_misleads_the_last_velocity_alone() -> None:
    joints, velocity = carried(0)
    wrong = joints.copy()
    wrong[-2] += 0.05
    true = joints[-1] + AHEAD * velocity
    assert np.abs(last_velocity(history(wrong)) - true).max() > 0.9
    assert np.abs(constant_velocity(history(wrong)) - true).max() < 0.2


@pytest.mark.parametrize("name", ALL)
def test_hidden_joints_are_filled_in(name: str) -> None:
    joints, _ = carried(1)
    joints[10:, 2] = np.nan
    found = ALL[name](history(joints))
    assert found.shape == (FUTURE + 1, 6, 3)
    assert np.isfinite(found).all()


def test_ridge_is_the_shipped_predictor_at_its_own_step() -> None:
    joints = drawn_scene(2).joints
    expected = RIDGE.predict(joints, PERIOD, FUTURE)
    np.testing.assert_array_equal(mean_of(RIDGE)(history(joints)), expected)
