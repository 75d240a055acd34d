"""Frames of arms: there and back, and the same for both arms of a person and a mirror image."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.heading import headings
from drake_dress.models.human.learned.arm_frame import ArmFrames, facing, swapped_sides
from tests.models.human.learned.drawn import about_vertical, drawn_scene, mirrored

seeds = st.integers(0, 2**32 - 1)
angles = st.floats(-3.0, 3.0)


def persons(seed: int, count: int = 3) -> np.ndarray:
    """Returns joints (B,T,6,3), m, of moving persons."""
    return np.stack([drawn_scene(seed + k, 4).joints for k in range(count)])


@given(seeds, angles)
def test_world_takes_points_back(seed: int, turned: float) -> None:
    joints = persons(seed)
    frames = ArmFrames.of(joints[:, -1], np.full(len(joints), turned))
    back = frames.world(frames.points(joints))
    np.testing.assert_allclose(back, np.concatenate([joints, joints]), atol=1e-12)


@given(seeds)
def test_frames_are_orthogonal_and_those_of_right_arms_mirror(seed: int) -> None:
    frames = ArmFrames.of(persons(seed)[:, -1])
    product = frames.matrix @ np.swapaxes(frames.matrix, 1, 2)
    np.testing.assert_allclose(product, np.tile(np.eye(3), (6, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(frames.matrix), [1, 1, 1, -1, -1, -1], atol=1e-12)
    np.testing.assert_array_equal(frames.matrix[:, 2], np.tile([0.0, 0.0, 1.0], (6, 1)))


@given(seeds, angles)
def test_mirrored_persons_have_equal_joints_with_the_arms_swapped(seed: int, turned: float) -> None:
    joints = persons(seed)
    turn = np.full(len(joints), turned)
    seen = ArmFrames.of(joints[:, -1], turn).joints(joints)
    image = mirrored(joints)
    of_image = ArmFrames.of(image[:, -1], -turn).joints(image)
    half = len(joints)
    np.testing.assert_allclose(of_image[:half], seen[half:], atol=1e-12)
    np.testing.assert_allclose(of_image[half:], seen[:half], atol=1e-12)


@given(seeds, angles)
def test_moved_and_turned_person_has_the_same_joints(seed: int, yaw: float) -> None:
    joints = persons(seed)
    moved = joints @ about_vertical(yaw).T + [3.0, -1.0, 0.5]
    seen = [ArmFrames.of(j[:, -1]).joints(j) for j in (joints, moved)]
    np.testing.assert_allclose(seen[1], seen[0], atol=1e-12)


@given(seeds)
def test_an_arm_sees_its_own_joints_first_from_its_shoulder_now(seed: int) -> None:
    joints = persons(seed)
    seen = ArmFrames.of(joints[:, -1]).joints(joints)
    np.testing.assert_allclose(seen[:, -1, 0], 0.0, atol=1e-12)
    half = len(joints)
    for rows, own, other in ((seen[:half], 0, 3), (seen[half:], 3, 0)):
        for first, arm in ((0, own), (3, other)):
            size = np.linalg.norm(rows[:, :, first : first + 3], axis=3)
            away = joints[:, :, arm : arm + 3] - joints[:, -1:, own : own + 1]
            np.testing.assert_allclose(size, np.linalg.norm(away, axis=3), atol=1e-12)
    # the other shoulder is to the right of both
    assert (seen[:, -1, 3, 1] < -0.3).all()


@given(seeds, angles)
def test_turned_frames_are_turned(seed: int, turned: float) -> None:
    joints = persons(seed, 1)
    straight = ArmFrames.of(joints[:, -1]).directions(joints)
    found = ArmFrames.of(joints[:, -1], np.array([turned])).directions(joints)
    np.testing.assert_allclose(found[0], straight[0] @ about_vertical(turned), atol=1e-12)
    np.testing.assert_allclose(found[1], straight[1] @ about_vertical(-turned), atol=1e-12)


@given(seeds)
def test_facing_is_horizontal_of_unit_length_and_as_the_heading(seed: int) -> None:
    joints = persons(seed)[:, -1]
    front = facing(joints)
    assert front.shape == (len(joints), 2)
    np.testing.assert_allclose(np.linalg.norm(front, axis=1), 1.0)
    np.testing.assert_allclose(front, headings(joints).front[:, :2], atol=1e-12)


def test_shoulders_straight_above_each_other_face_along_x() -> None:
    joints = np.zeros((1, 6, 3))
    joints[0, 0, 2] = 0.3
    np.testing.assert_array_equal(facing(joints), [[1.0, 0.0]])


def test_what_is_left_and_right_becomes_own_and_other() -> None:
    pairs = np.array([[["left", "right"]], [["links", "rechts"]]])
    found = swapped_sides(pairs)
    assert found[:, 0].tolist() == [
        ["left", "right"],
        ["links", "rechts"],
        ["right", "left"],
        ["rechts", "links"],
    ]


@pytest.mark.parametrize("shape", [(2, 3), (2, 4, 3), (2, 4, 6, 3)])
def test_points_of_any_shape_are_taken(shape: tuple[int, ...]) -> None:
    points = np.random.default_rng(0).normal(size=shape)
    frames = ArmFrames.of(persons(0, 2)[:, -1])
    assert frames.points(points).shape == (4, *shape[1:])
    np.testing.assert_allclose(frames.world(frames.points(points))[2:], points, atol=1e-12)
