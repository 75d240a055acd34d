"""The linear predictor of joints: rest stays rest, lengths are kept, the unseen is not told."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.human.learned.linear import LinearMotion
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD
from drake_dress.models.human.learned.ridge import RidgePredictor
from drake_dress.models.human.prediction import with_lengths
from tests.models.human.learned.drawn import (
    about_vertical,
    drawn_networks,
    drawn_scene,
    lengths,
    mirrored,
)

PREDICTOR = RidgePredictor(drawn_networks(0).linear)
seeds = st.integers(0, 2**32 - 1)


def constant_velocity() -> RidgePredictor:
    """Returns one whose map continues the last step."""
    way = np.zeros((3, HISTORY - 1, FUTURE))
    way[:, -1] = -np.arange(1, FUTURE + 1)
    return RidgePredictor(LinearMotion(way))


@given(seeds, st.sampled_from([0.02, 0.1, 0.25]), st.integers(0, 12))
@settings(max_examples=20)
def test_lengths_are_kept_and_row_0_is_now(seed: int, step: float, steps: int) -> None:
    joints = drawn_scene(seed).joints
    found = PREDICTOR.predict(joints, step, steps)
    assert found.shape == (steps + 1, 6, 3)
    np.testing.assert_allclose(found[0], joints[-1], atol=1e-12)
    expected = np.tile(lengths(joints[-1]), (steps + 1, 1))
    np.testing.assert_allclose(lengths(found), expected, atol=1e-9)


@given(seeds)
@settings(max_examples=20)
def test_person_at_rest_stays(seed: int) -> None:
    joints = np.tile(drawn_scene(seed, 1).joints, (HISTORY, 1, 1))
    found = PREDICTOR.predict(joints, PERIOD, FUTURE)
    np.testing.assert_allclose(found, np.tile(joints[-1], (FUTURE + 1, 1, 1)), atol=1e-12)


@given(seeds, st.floats(-3.0, 3.0))
@settings(max_examples=20)
def test_moved_turned_and_mirrored_persons_are_predicted_alike(seed: int, yaw: float) -> None:
    joints = drawn_scene(seed).joints
    found = PREDICTOR.predict(joints, PERIOD, FUTURE)
    turn, shift = about_vertical(yaw).T, np.random.default_rng(seed).normal(size=3)
    moved = PREDICTOR.predict(joints @ turn + shift, PERIOD, FUTURE)
    np.testing.assert_allclose(moved, found @ turn + shift, atol=1e-9)
    image = PREDICTOR.predict(mirrored(joints), PERIOD, FUTURE)
    np.testing.assert_allclose(image, mirrored(found), atol=1e-9)


@given(seeds, st.floats(0.01, 0.4))
@settings(max_examples=20)
def test_between_samples_it_is_interpolated_and_after_two_seconds_it_stays(
    seed: int, step: float
) -> None:
    rng = np.random.default_rng(seed)
    velocity = rng.normal(size=3)
    times = PERIOD * np.arange(1 - HISTORY, 1)
    joints = drawn_scene(seed, 1).joints[0] + times[:, None, None] * velocity
    found = constant_velocity().predict(joints, step, 12)
    ahead = np.minimum(step * np.arange(13), FUTURE * PERIOD)
    np.testing.assert_allclose(found, joints[-1] + ahead[:, None, None] * velocity, atol=1e-9)


@given(seeds, st.integers(0, 5))
@settings(max_examples=20)
def test_joint_never_seen_is_nan_and_alone_so(seed: int, joint: int) -> None:
    joints = drawn_scene(seed).joints.copy()
    joints[:, joint] = np.nan
    found = PREDICTOR.predict(joints, PERIOD, 5)
    assert np.isnan(found[:, joint]).all()
    assert np.isfinite(np.delete(found, joint, axis=1)).all()


@given(seeds, st.integers(0, 5))
@settings(max_examples=20)
def test_joint_seen_before_is_filled_in(seed: int, joint: int) -> None:
    joints = drawn_scene(seed).joints.copy()
    joints[HISTORY // 2 :, joint] = np.nan
    found = PREDICTOR.predict(joints, PERIOD, 5)
    assert np.isfinite(found).all()
    again = [with_lengths(q, found[0]) for q in found]
    np.testing.assert_allclose(again, found, atol=1e-9)
