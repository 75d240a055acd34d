"""Predictors: exact where they claim to be, bounded elsewhere, and unmoved by what is not seen."""

import numpy as np
import pytest

from drake_dress.models.human.body import ArmPose, BodyMeasures, arm_points
from drake_dress.models.human.prediction import (
    ConstantVelocityPredictor,
    MotionPredictor,
    StillPredictor,
    last_seen,
    resampled,
)
from drake_dress.models.sides import SIDES

LIMBS = ((0, 3), (0, 1), (1, 2), (3, 4), (4, 5))
PREDICTORS = (StillPredictor(), ConstantVelocityPredictor())


def joints(swing: float = 0.0) -> np.ndarray:
    """Returns (6,3) joints of a person whose arms have swung by an angle, rad."""
    pose = ArmPose(0.3 + swing, 0.8 - 0.5 * swing, 0.1, 0.4 + swing)
    return np.vstack([arm_points(BodyMeasures(), "standing", s, pose) for s in SIDES])


def lengths(q: np.ndarray) -> np.ndarray:
    return np.array([np.linalg.norm(q[a] - q[b]) for a, b in LIMBS])


def moving(p: MotionPredictor, velocity: np.ndarray) -> np.ndarray:
    """Returns a history (T,6,3) of a person carried along at constant velocity."""
    past = p.sample_period * (np.arange(p.history_length) - p.history_length + 1)
    return joints() + past[:, None, None] * velocity


def swinging(p: MotionPredictor, speed: float) -> np.ndarray:
    past = p.sample_period * (np.arange(p.history_length) - p.history_length + 1)
    return np.stack([joints(speed * t) for t in past])


@pytest.mark.parametrize("p", PREDICTORS)
def test_row_zero_is_now_and_shapes_are_as_asked(p: MotionPredictor) -> None:
    history = swinging(p, 1.0)
    for step, count in ((0.1, 8), (0.02, 3), (0.5, 0)):
        predicted = p.predict(history, step, count)
        assert predicted.shape == (count + 1, 6, 3)
        np.testing.assert_array_equal(predicted[0], history[-1])


@pytest.mark.parametrize("p", PREDICTORS)
def test_who_stands_still_is_predicted_to(p: MotionPredictor) -> None:
    predicted = p.predict(moving(p, np.zeros(3)), 0.1, 8)
    np.testing.assert_allclose(predicted, np.tile(joints(), (9, 1, 1)), atol=1e-12)


def test_still_repeats_the_last_sample_to_the_bit() -> None:
    history = swinging(ConstantVelocityPredictor(), 2.0)
    predicted = StillPredictor().predict(history, 0.1, 5)
    np.testing.assert_array_equal(predicted, np.tile(history[-1], (6, 1, 1)))


def test_constant_velocity_is_predicted_exactly() -> None:
    p = ConstantVelocityPredictor(decay_time=np.inf)
    velocity = np.array([0.2, -0.3, 0.1])
    predicted = p.predict(moving(p, velocity), 0.1, 8)
    ahead = 0.1 * np.arange(9)[:, None, None]
    np.testing.assert_allclose(predicted, joints() + ahead * velocity, atol=1e-12)


def test_velocity_dies_away_with_the_horizon() -> None:
    p = ConstantVelocityPredictor(decay_time=0.5)
    velocity = np.array([0.2, -0.3, 0.1])
    way = p.predict(moving(p, velocity), 0.1, 200) - joints()
    np.testing.assert_allclose(way[1], 0.1 * np.tile(velocity, (6, 1)), rtol=0.11)
    np.testing.assert_allclose(way[-1], 0.5 * np.tile(velocity, (6, 1)), rtol=1e-6)
    assert (np.diff(np.linalg.norm(way, axis=2), axis=0) >= -1e-12).all()


def test_limbs_keep_their_lengths() -> None:
    p = ConstantVelocityPredictor(max_speed=10.0, decay_time=np.inf)
    for speed in (-3.0, 1.0, 4.0):
        predicted = p.predict(swinging(p, speed), 0.1, 10)
        assert np.linalg.norm(predicted[-1] - predicted[0], axis=1).max() > 0.1
        for q in predicted:
            np.testing.assert_allclose(lengths(q), lengths(joints()), rtol=1e-9)


def test_speed_is_capped() -> None:
    p = ConstantVelocityPredictor(max_speed=0.5, decay_time=np.inf)
    predicted = p.predict(moving(p, np.array([3.0, 0.0, 4.0])), 0.1, 5)
    np.testing.assert_allclose(predicted[-1] - joints(), np.tile([0.15, 0.0, 0.2], (6, 1)))


def test_prediction_turns_with_the_person() -> None:
    """A quarter turn of the world turns what is predicted, up to the limb-wise median."""
    p = ConstantVelocityPredictor()
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    history = swinging(p, 1.5)
    straight, turned = p.predict(history, 0.1, 6), p.predict(history @ turn.T, 0.1, 6)
    np.testing.assert_allclose(turned, straight @ turn.T, atol=1e-12)


def test_joints_that_were_not_seen_now_and_then_change_nothing() -> None:
    p = ConstantVelocityPredictor(decay_time=np.inf)
    velocity = np.array([0.2, 0.1, -0.1])
    history = moving(p, velocity)
    history[[1, 4], 2] = np.nan
    history[3, 0, 1] = np.nan
    predicted = p.predict(history, 0.1, 5)
    np.testing.assert_allclose(predicted[-1], joints() + 0.5 * velocity, atol=1e-12)


def test_samples_that_are_wrong_hardly_matter() -> None:
    p = ConstantVelocityPredictor(decay_time=np.inf)
    velocity = np.array([0.2, 0.1, -0.1])
    history = moving(p, velocity)
    history[3] += 0.5
    way = p.predict(history, 0.1, 5)[-1] - joints()
    np.testing.assert_allclose(way, np.tile(0.5 * velocity, (6, 1)), atol=1e-9)


@pytest.mark.parametrize("p", PREDICTORS)
def test_joint_never_seen_is_nan_and_alone_so(p: MotionPredictor) -> None:
    history = moving(p, np.array([0.1, 0.0, 0.0]))
    history[:, 1] = np.nan
    predicted = p.predict(history, 0.1, 4)
    assert np.isnan(predicted[:, 1]).all()
    assert np.isfinite(np.delete(predicted, 1, axis=1)).all()


def test_joint_seen_twice_is_taken_to_stand_still() -> None:
    p = ConstantVelocityPredictor()
    history = moving(p, np.array([0.3, 0.0, 0.0]))
    history[:-2] = np.nan
    np.testing.assert_allclose(p.predict(history, 0.1, 4)[-1], history[-1])


def test_last_seen_is_told_joint_by_joint() -> None:
    history = np.arange(54.0).reshape(3, 6, 3)
    history[2, 4] = np.nan
    history[1:, 5] = np.nan
    seen = last_seen(history)
    np.testing.assert_array_equal(seen[:4], history[2, :4])
    np.testing.assert_array_equal(seen[4], history[1, 4])
    np.testing.assert_array_equal(seen[5], history[0, 5])


@pytest.mark.parametrize("age", [0.0, 0.3, 1.0])
def test_resampled_history_of_a_line_is_the_line(age: float) -> None:
    times = np.arange(5.0)
    now = times[-1] + age
    np.testing.assert_allclose(resampled(times, np.array(now), age), now - np.arange(5.0)[::-1])


def test_at_a_sample_what_was_not_seen_stays_with_its_sample() -> None:
    samples = np.array([0.0, np.nan, 2.0, 3.0])
    np.testing.assert_array_equal(resampled(samples, np.array(4.0), 1.0), [np.nan, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(resampled(samples, np.array(3.0), 0.0), [0.0, np.nan, 2.0, 3.0])
