"""The recurrent baseline is the same in NumPy and torch, and reads all of the history."""

import numpy as np
import pytest
import torch

from drake_dress.models.human.learned.recurrent import (
    RecurrentPredictor,
    recurrent_motion,
    recurrent_weights,
)
from drake_dress.models.human.learned.tokens import TOKEN_SIZE
from tests.models.human.learned.drawn import Scene, drawn_scene, lengths, mirrored

RNG = np.random.default_rng(0)
WEIGHTS = recurrent_weights(RNG)
TOKENS = RNG.normal(size=(3, 20, TOKEN_SIZE)).astype(np.float32)


def test_numpy_and_torch_agree() -> None:
    tensors = {name: torch.from_numpy(array) for name, array in WEIGHTS.items()}
    found = recurrent_motion(WEIGHTS, TOKENS)
    assert found.shape == (3, 21, 3, 3)
    other = recurrent_motion(tensors, torch.from_numpy(TOKENS)).numpy()
    np.testing.assert_allclose(found, other, atol=1e-5)


def test_every_step_of_the_history_counts() -> None:
    plain = recurrent_motion(WEIGHTS, TOKENS)
    for step in (0, 10, 19):
        changed = TOKENS.copy()
        changed[:, step] += 1.0
        assert np.abs(recurrent_motion(WEIGHTS, changed) - plain).max() > 0.0


def predictor() -> RecurrentPredictor:
    return RecurrentPredictor(WEIGHTS)


@pytest.mark.parametrize("seed", range(4))
def test_prediction_moves_and_turns_with_the_person_and_keeps_limbs(seed: int) -> None:
    scene = drawn_scene(seed)
    found = predictor().predict(scene.joints, 0.1, 20)
    assert found.shape == (21, 6, 3)
    np.testing.assert_allclose(lengths(found), np.tile(lengths(found[0]), (21, 1)), atol=1e-9)
    moved = scene.moved(0.7 + seed, np.array([0.4, -2.0, 0.1]))
    other = predictor().predict(moved.joints, 0.1, 20)
    expected = Scene(found, np.zeros((21, 2, 6))).moved(0.7 + seed, np.array([0.4, -2.0, 0.1]))
    np.testing.assert_allclose(other, expected.joints, atol=1e-5)
    image = predictor().predict(mirrored(scene.joints), 0.1, 20)
    np.testing.assert_allclose(image, mirrored(found), atol=1e-5)


def test_joint_that_was_never_seen_is_not_predicted_and_others_are() -> None:
    joints = drawn_scene(3).joints.copy()
    joints[:, 5] = np.nan
    found = predictor().predict(joints, 0.05, 10)
    assert np.isnan(found[:, 5]).all()
    assert np.isfinite(found[:, :5]).all()


def test_after_two_seconds_joints_stay() -> None:
    found = predictor().predict(drawn_scene(1).joints, 0.5, 10)
    np.testing.assert_array_equal(found[4], found[10])
