"""Predicted joints become a person's: lengths are exact, limits hold, the rest is left alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.arm_angles import arm_angles
from drake_dress.models.human.body import ArmPose, arm_rotations
from drake_dress.models.human.learned.kinematics import (
    LIMITS,
    Lengths,
    arm_angles_of,
    limb_directions,
    person_like,
)
from tests.models.human.learned.drawn import (
    about_vertical,
    drawn_scene,
    lengths,
    mirrored,
    pose,
)

DOWN = np.array([0.0, 0.0, -1.0])
seeds = st.integers(0, 2**32 - 1)


def of_person(joints: np.ndarray) -> Lengths:
    """Returns the lengths of a person with joints (6,3), m."""
    return Lengths.of(joints[None, None])


def like(joints: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Returns joints (…,6,3) as those of the person whose joints are `now` (6,3)."""
    return person_like(joints[None], of_person(now), now[None])[0]


def within(rng: np.random.Generator, margin: float = 0.0) -> np.ndarray:
    """Returns angles (2,4) of both arms within the limits, rad."""
    return rng.uniform(LIMITS[0] + margin, LIMITS[1] - margin, (2, 4))


def distance_to_limits(joints: np.ndarray, side: int) -> float:
    """Returns by how much an arm is beyond its limits at least, rad, by `arm_angles`."""
    arm = joints[3 * side : 3 * side + 3]
    line = joints[0] - joints[3]
    turn = about_vertical(-float(np.arctan2(-line[0], line[1])))
    upper, fore = (turn @ (arm[k + 1] - arm[k]) for k in (0, 1))
    sets = arm_angles(
        "left" if side == 0 else "right", upper / np.linalg.norm(upper), fore / np.linalg.norm(fore)
    )
    turns = 2.0 * np.pi * np.arange(-1, 2)[:, None, None]
    off = np.maximum(LIMITS[0] - (sets + turns), sets + turns - LIMITS[1]).clip(0.0).min(axis=0)
    return float(off.sum(axis=1).min())


@given(seeds, st.floats(0.01, 0.5))
def test_lengths_are_exact_whatever_is_predicted(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    now = drawn_scene(seed, 1).joints[0]
    predicted = now + size * rng.normal(size=(3, 4, 6, 3))
    found = like(predicted, now)
    assert found.shape == predicted.shape
    expected = np.broadcast_to(lengths(now), (3, 4, 5))
    np.testing.assert_allclose(lengths(found), expected, atol=1e-9)
    middle = predicted[..., [0, 3], :].mean(axis=-2)
    np.testing.assert_allclose(found[..., [0, 3], :].mean(axis=-2), middle, atol=1e-12)


@given(seeds, st.floats(-3.0, 3.0))
def test_poses_within_the_limits_are_left_alone(seed: int, yaw: float) -> None:
    """Also where limits go beyond half a turn."""
    rng = np.random.default_rng(seed)
    now = pose(np.array([[0.3, 0.0, 0.0, 0.3]] * 2), yaw)
    predicted = np.stack([pose(within(rng, 1e-3), yaw) for _ in range(5)])
    np.testing.assert_allclose(like(predicted, now), predicted, atol=1e-7)


@pytest.mark.parametrize("extension", [-0.1, 0.0, 0.1])
def test_arm_that_is_raised_past_the_vertical_does_not_jump(extension: float) -> None:
    now = pose(np.array([[3.0, extension, 0.2, 0.3]] * 2))
    angles = np.array([[[a, extension, 0.2, 0.3]] * 2 for a in np.linspace(3.0, 3.4, 41)])
    found = like(np.stack([pose(a) for a in angles]), now)
    assert np.abs(np.diff(found, axis=0)).max() < 0.01
    np.testing.assert_allclose(found[:20], [pose(a) for a in angles[:20]], atol=1e-9)


@given(seeds, st.integers(0, 1))
def test_limits_hold_for_whatever_is_predicted(seed: int, side: int) -> None:
    rng = np.random.default_rng(seed)
    now = pose(np.array([[0.3, 0.0, 0.0, 0.3]] * 2), float(rng.uniform(-3.0, 3.0)))
    predicted = now + 0.4 * rng.normal(size=(6, 6, 3))
    for joints in like(predicted, now):
        assert distance_to_limits(joints, side) < 1e-6


@given(seeds, st.floats(2.71, 3.1))
def test_elbow_is_never_beyond_its_limit_unless_it_is_already(seed: int, flexion: float) -> None:
    rng = np.random.default_rng(seed)
    angles = within(rng, 0.05)
    bent = angles.copy()
    bent[:, 3] = flexion

    def flexions(joints: np.ndarray) -> np.ndarray:
        arms = joints.reshape(2, 3, 3)
        upper, fore = arms[:, 1] - arms[:, 0], arms[:, 2] - arms[:, 1]
        size = np.linalg.norm(upper, axis=1) * np.linalg.norm(fore, axis=1)
        angle: np.ndarray = np.arccos(np.clip((upper * fore).sum(axis=1) / size, -1.0, 1.0))
        return angle

    np.testing.assert_allclose(flexions(like(pose(bent)[None], pose(angles))[0]), 2.7, atol=1e-6)
    # who is there already may stay, but goes no further
    beyond = bent.copy()
    beyond[:, 3] = min(flexion + 0.2, 3.14)
    np.testing.assert_allclose(like(pose(bent)[None], pose(bent))[0], pose(bent), atol=1e-6)
    stays = flexions(like(pose(beyond)[None], pose(bent))[0])
    np.testing.assert_allclose(stays, flexion, atol=1e-5)


@given(seeds, st.floats(-3.0, 3.0))
def test_moved_turned_and_mirrored_persons_are_treated_alike(seed: int, yaw: float) -> None:
    rng = np.random.default_rng(seed)
    now = drawn_scene(seed, 1).joints[0]
    predicted = now + 0.2 * rng.normal(size=(3, 6, 3))
    found = like(predicted, now)
    turn, shift = about_vertical(yaw).T, rng.normal(size=3)
    moved = like(predicted @ turn + shift, now @ turn + shift)
    np.testing.assert_allclose(moved, found @ turn + shift, atol=1e-6)
    image = like(mirrored(predicted), mirrored(now))
    np.testing.assert_allclose(image, mirrored(found), atol=1e-6)


@given(seeds)
def test_what_is_a_persons_already_is_not_changed_again(seed: int) -> None:
    rng = np.random.default_rng(seed)
    now = drawn_scene(seed, 1).joints[0]
    once = like(now + 0.3 * rng.normal(size=(5, 6, 3)), now)
    np.testing.assert_allclose(like(once, now), once, atol=1e-6)


def test_lengths_are_medians_so_that_a_few_wrong_joints_do_not_matter() -> None:
    scene = drawn_scene(1)
    joints = scene.joints.copy()
    joints[[3, 9, 15]] += np.random.default_rng(0).normal(size=(3, 6, 3))
    found = Lengths.of(joints[None])
    expected = lengths(scene.joints[0])
    np.testing.assert_allclose(found.shoulders, expected[:1], atol=1e-9)
    np.testing.assert_allclose(found.limbs, expected[None, 1:], atol=1e-9)


def test_several_persons_keep_their_own_lengths() -> None:
    now = np.stack([drawn_scene(0, 1).joints[0], 1.2 * drawn_scene(1, 1).joints[0]])
    predicted = now[:, None] + 0.1 * np.random.default_rng(0).normal(size=(2, 3, 6, 3))
    found = person_like(predicted, Lengths.of(now[:, None]), now)
    for k in (0, 1):
        np.testing.assert_allclose(found[k], like(predicted[k], now[k]), atol=1e-12)


@given(st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3), st.floats(0.0, 3.0)))
def test_directions_are_those_of_the_body_model(angles: tuple[float, float, float, float]) -> None:
    upper, fore = limb_directions(np.array([angles]))
    rotations = arm_rotations("left", ArmPose(*angles))
    np.testing.assert_allclose(upper[0], rotations[0] @ DOWN, atol=1e-12)
    np.testing.assert_allclose(fore[0], rotations[1] @ DOWN, atol=1e-12)


@given(seeds)
def test_angles_of_many_arms_are_those_of_one(seed: int) -> None:
    """A straight arm and one that points straight forward have no definite rotation."""
    low, high = [-3.1, -1.4, -3.1, 0.1], [3.1, 1.4, 3.1, 3.0]
    upper, fore = limb_directions(np.random.default_rng(seed).uniform(low, high, (5, 4)))
    found = arm_angles_of(upper, fore)
    assert found.shape == (2, 5, 4)
    for k in range(5):
        expected = arm_angles("left", upper[k], fore[k])
        np.testing.assert_allclose(np.exp(1j * found[:, k]), np.exp(1j * expected), atol=1e-9)


@given(st.lists(st.tuples(*[st.floats(-3, 3)] * 3, st.floats(0.0, 3.0)), min_size=1, max_size=5))
def test_both_sets_of_angles_lead_back_to_the_directions(
    angles: list[tuple[float, float, float, float]],
) -> None:
    upper, fore = limb_directions(np.array(angles))
    for way in arm_angles_of(upper, fore):
        again = limb_directions(way)
        np.testing.assert_allclose(again[0], upper, atol=1e-7)
        np.testing.assert_allclose(again[1], fore, atol=1e-7)
