"""The linear predictor: a linear law is found, and neither place nor direction matters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.learned.linear import LinearFit, LinearMotion

T, F = 5, 3
seeds = st.integers(0, 2**32 - 1)


def drawn_map(seed: int) -> LinearMotion:
    return LinearMotion(np.random.default_rng(seed).normal(size=(3, T - 1, F)))


def histories(seed: int, count: int = 4) -> np.ndarray:
    """Returns (N,T,3,3) of shoulder, elbow, hand, m."""
    return np.random.default_rng(seed).normal(size=(count, T, 3, 3))


def test_fit_finds_a_linear_law() -> None:
    law, fit = drawn_map(0), LinearFit(T, F)
    for seed in range(5):
        joints = histories(seed, 200)
        fit.add(joints, law.displacement(joints))
    # the ridge takes a thousandth
    np.testing.assert_allclose(fit.solved().map, law.map, atol=0.02)


def test_each_joint_has_its_own_map_and_every_sample_counts() -> None:
    law = drawn_map(1)
    joints = histories(1, 1)
    base = law.displacement(joints)
    for joint in range(3):
        for step in range(T - 1):
            changed = joints.copy()
            changed[0, step, joint] += 0.1
            off = np.abs(law.displacement(changed) - base).max(axis=(0, 1, 3))
            np.testing.assert_array_equal(off > 1e-9, np.arange(3) == joint)


@given(seeds)
def test_prediction_is_turned_with_the_person_wherever_it_stands(seed: int) -> None:
    """About any axis, and in a mirror."""
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    law, joints = drawn_map(seed), histories(seed)
    found = law.displacement(joints @ turn + rng.normal(size=3))
    np.testing.assert_allclose(found, law.displacement(joints) @ turn, atol=1e-9)


@given(seeds)
def test_person_at_rest_is_predicted_to_rest_and_row_0_is_now(seed: int) -> None:
    joints = histories(seed)
    law = drawn_map(seed)
    rest = np.repeat(joints[:, -1:], T, axis=1)
    np.testing.assert_array_equal(law.displacement(rest), 0.0)
    assert law.displacement(joints).shape == (4, F + 1, 3, 3)
    np.testing.assert_array_equal(law.displacement(joints)[:, 0], 0.0)


@given(seeds, st.floats(-3.0, 3.0))
def test_prediction_is_linear(seed: int, factor: float) -> None:
    law, first, second = drawn_map(seed), histories(seed), histories(seed + 1)
    both = law.displacement(first + factor * second)
    expected = law.displacement(first) + factor * law.displacement(second)
    np.testing.assert_allclose(both, expected, atol=1e-9)


def test_fast_movements_do_not_set_the_map_alone() -> None:
    """Two kinds of persons go on differently; the fast ones' errors count relative to their way."""
    slow, fast = (
        LinearMotion(np.full((3, T - 1, F), -0.1)),
        LinearMotion(np.full((3, T - 1, F), 0.1)),
    )
    fit = LinearFit(T, F)
    small, large = 0.1 * histories(0, 300), 10.0 * histories(1, 300)
    fit.add(small, slow.displacement(small))
    fit.add(large, fast.displacement(large))
    # by plain squares the fast ones would win by 10⁴ : 1
    assert np.abs(fit.solved().map).max() < 0.09


def test_batches_add_up() -> None:
    law, joints = drawn_map(2), histories(2, 100)
    wanted = law.displacement(joints) + 0.1 * np.random.default_rng(0).normal(
        size=(100, F + 1, 3, 3)
    )
    whole, parts = LinearFit(T, F), LinearFit(T, F)
    whole.add(joints, wanted)
    for part in (slice(0, 30), slice(30, 100)):
        parts.add(joints[part], wanted[part])
    np.testing.assert_allclose(parts.solved().map, whole.solved().map, rtol=1e-9)


def test_unlearnable_noise_leads_to_no_motion() -> None:
    rng = np.random.default_rng(0)
    fit = LinearFit(T, F)
    fit.add(histories(0, 20000), rng.normal(size=(20000, F + 1, 3, 3)))
    assert np.abs(fit.solved().map).max() == pytest.approx(0.0, abs=0.03)
