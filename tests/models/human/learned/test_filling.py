"""Hidden joints: what is seen stays, limbs keep their lengths, and a hidden arm goes along."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.learned.filling import filled, filled_pose, rotated_between
from tests.models.human.learned.drawn import (
    about_vertical,
    drawn_scene,
    lengths,
    mirrored,
    pose,
)

seeds = st.integers(0, 2**32 - 1)
shares = st.floats(0.0, 1.0)


def hidden(joints: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Returns joints (B,T,6,3) with NaN where not seen."""
    return np.where(seen[..., None], joints, np.nan)


def drawn(seed: int, share: float, count: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Returns persons (B,T,6,3), and which joints are seen, about a share of all."""
    joints = np.stack([drawn_scene(seed + k, 8).joints for k in range(count)])
    seen = np.random.default_rng(seed).random(joints.shape[:3]) < share
    return joints, seen


@given(seeds, shares)
def test_what_is_seen_stays_to_the_bit_and_nothing_is_missing(seed: int, share: float) -> None:
    joints, seen = drawn(seed, share)
    result, told = filled(hidden(joints, seen))
    np.testing.assert_array_equal(told, seen)
    np.testing.assert_array_equal(result[seen], joints[seen])
    assert np.isfinite(result).all()


def test_history_without_gaps_is_returned_as_it_is() -> None:
    joints, _ = drawn(0, 1.0)
    assert filled(joints)[0] is joints


@given(seeds, shares)
def test_a_joint_of_which_one_coordinate_is_missing_is_hidden(seed: int, share: float) -> None:
    joints, seen = drawn(seed, share)
    part = joints.copy()
    part[..., seed % 3][~seen] = np.nan
    np.testing.assert_array_equal(filled(part)[0], filled(hidden(joints, seen))[0])


@given(seeds, st.sampled_from([(1,), (2,), (1, 2), (4,), (5,), (4, 5), (1, 2, 4, 5), (2, 4)]))
def test_hidden_arms_keep_the_lengths_of_their_limbs(seed: int, which: tuple[int, ...]) -> None:
    """A hidden elbow between a seen shoulder and a seen hand keeps both."""
    joints, seen = drawn(seed, 1.0)
    seen[:, 2:, which] = False
    result, _ = filled(hidden(joints, seen))
    np.testing.assert_allclose(lengths(result), lengths(joints), atol=1e-9)


@given(seeds, st.booleans())
def test_arm_hidden_while_the_person_turns_and_walks_goes_along(seed: int, right: bool) -> None:
    rng = np.random.default_rng(seed)
    first = drawn_scene(seed, 1).joints[0]
    yaws, shifts = np.cumsum(rng.uniform(-0.8, 0.8, 6)), rng.normal(size=(6, 3))
    moved = [first @ about_vertical(y).T + s for y, s in zip(yaws, shifts, strict=True)]
    true = np.stack([first, *moved])
    seen = np.ones((1, 7, 6), dtype=bool)
    seen[:, 1:, [4, 5] if right else [1, 2]] = False
    result, _ = filled(hidden(true[None], seen))
    np.testing.assert_allclose(result[0], true, atol=1e-9)


@given(seeds)
def test_hidden_hand_keeps_its_angle_to_the_upper_arm(seed: int) -> None:
    joints, seen = drawn(seed, 1.0)
    seen[:, 1:, 2] = False
    result, _ = filled(hidden(joints, seen))
    upper, fore = result[:, :, 1] - result[:, :, 0], result[:, :, 2] - result[:, :, 1]
    cosine = (upper * fore).sum(axis=2)
    np.testing.assert_allclose(cosine, np.tile(cosine[:, :1], (1, 8)), atol=1e-9)


@given(seeds)
def test_hidden_elbow_is_as_near_as_lengths_allow_to_where_it_was_held(seed: int) -> None:
    """No other point at both lengths is nearer; it is where it was if nothing moves."""
    rng = np.random.default_rng(seed)
    before = drawn_scene(seed, 1).joints
    now = before.copy()
    shift = 0.1 * rng.normal(size=3)
    now[0, 2] = now[0, 0] + (now[0, 2] - now[0, 0]) * rng.uniform(0.8, 1.0)
    seen = np.ones((1, 6), dtype=bool)
    seen[:, 1] = False
    np.testing.assert_allclose(filled_pose(before, seen, before), before, atol=1e-9)
    shoulder, elbow, hand = filled_pose(now + shift, seen, before + shift)[0, :3] - shift
    axis = (hand - shoulder) / np.linalg.norm(hand - shoulder)
    middle = shoulder + ((elbow - shoulder) @ axis) * axis
    off = elbow - middle
    side = np.cross(axis, off)
    angles = np.linspace(0.05, 2.0 * np.pi - 0.05, 60)[:, None]
    others = middle + np.cos(angles) * off + np.sin(angles) * side
    distance = np.linalg.norm(others - before[0, 1], axis=1)
    assert (distance >= np.linalg.norm(elbow - before[0, 1]) - 1e-9).all()


def test_hand_farther_than_the_arm_reaches_straightens_it_and_stretches_both_limbs_alike() -> None:
    before = drawn_scene(0, 1).joints
    now = before.copy()
    now[0, 2] = now[0, 0] + 2.0 * (now[0, 2] - now[0, 0])
    seen = np.ones((1, 6), dtype=bool)
    seen[:, 1] = False
    shoulder, elbow, hand = filled_pose(now, seen, before)[0, :3]
    upper = np.linalg.norm(before[0, 1] - before[0, 0])
    fore = np.linalg.norm(before[0, 2] - before[0, 1])
    share = upper / (upper + fore)
    np.testing.assert_allclose(elbow, shoulder + share * (hand - shoulder), atol=1e-4)


@pytest.mark.parametrize("rising", [-0.6, 0.0, 0.9])
def test_elbow_of_an_arm_that_was_straight_bends_down(rising: float) -> None:
    """Across the arm, which may rise."""
    along = np.array([np.cos(rising), 0.0, np.sin(rising)])
    left = np.array([0.0, 0.2, 1.4]) + np.array([0.0, 0.3, 0.6])[:, None] * along
    before = np.concatenate([left, left * [1.0, -1.0, 1.0]])[None]
    now, seen = before.copy(), np.ones((1, 6), dtype=bool)
    now[0, 2], seen[0, 1] = left[0] + 0.4 * along, False
    elbow = filled_pose(now, seen, before)[0, 1]
    down = np.array([np.sin(rising), 0.0, -np.cos(rising)])
    np.testing.assert_allclose(elbow, left[0] + 0.2 * along + np.sqrt(0.05) * down, atol=1e-6)


@given(seeds, st.booleans())
def test_hidden_shoulder_moves_with_the_other(seed: int, right: bool) -> None:
    joints, seen = drawn(seed, 1.0)
    own, other = (3, 0) if right else (0, 3)
    seen[:, 1:, own] = False
    result, _ = filled(hidden(joints, seen))
    between = result[:, :, own] - result[:, :, other]
    np.testing.assert_allclose(between, np.tile(between[:, :1], (1, 8, 1)), atol=1e-12)


@given(seeds, shares)
def test_before_its_first_observation_a_hidden_arm_is_held_as_it_was_seen_first(
    seed: int, share: float
) -> None:
    joints = drawn_scene(seed, 8).joints[None]
    seen = np.ones((1, 8, 6), dtype=bool)
    since = 1 + round(6 * share)
    seen[:, :since] = False
    result, _ = filled(hidden(joints, seen))
    held = np.repeat(joints[:, since : since + 1], since, axis=1)
    np.testing.assert_allclose(result[:, :since], held, atol=1e-12)


@given(seeds, st.sampled_from([(2,), (1, 2), (4, 5), (0, 1, 2, 3, 4, 5)]))
def test_what_is_known_from_before_stands_where_a_joint_is_hidden_all_along(
    seed: int, which: tuple[int, ...]
) -> None:
    true = drawn_scene(seed, 1).joints
    joints = np.repeat(true[:, None], 8, axis=1)
    seen = np.ones((1, 8, 6), dtype=bool)
    seen[:, :, which] = False
    first = np.full((1, 6, 3), np.nan)
    first[:, which] = true[:, which]
    result, told = filled(hidden(joints, seen), first)
    np.testing.assert_allclose(result, joints, atol=1e-9)
    np.testing.assert_array_equal(told, seen)
    # without it, the arm hangs as usual
    assert np.abs(filled(hidden(joints, seen))[0] - joints).max() > 0.01


@given(seeds, st.integers(0, 2**6 - 1), st.floats(-3.0, 3.0))
def test_any_joints_never_seen_at_all_have_usual_places(seed: int, mask: int, yaw: float) -> None:
    """Arms of usual length that hang; they turn and mirror as the person does."""
    joints = np.repeat(drawn_scene(seed, 1).joints[:, None], 3, axis=1)
    seen = np.tile((mask >> np.arange(6)) & 1 > 0, (1, 3, 1))
    result, _ = filled(hidden(joints, seen))
    assert np.isfinite(result).all()
    for arm in (0, 3):
        if not seen[0, 0, arm + 1] and not seen[0, 0, arm + 2]:
            limbs = lengths(result)[..., [1, 2] if arm == 0 else [3, 4]]
            np.testing.assert_allclose(limbs, 0.275, atol=0.02)
            assert (result[..., arm + 1, 2] < result[..., arm, 2]).all()
            assert (result[..., arm + 2, 2] < result[..., arm + 1, 2]).all()
    if seen.any() and seen[0, 0, [0, 3]].all():
        turn = about_vertical(yaw).T
        turned, _ = filled(hidden(joints @ turn, seen))
        np.testing.assert_allclose(turned, result @ turn, atol=1e-9)
        image, _ = filled(hidden(mirrored(joints), seen[..., [3, 4, 5, 0, 1, 2]]))
        np.testing.assert_allclose(image, mirrored(result), atol=1e-9)


def test_only_one_arm_seen_tells_where_the_other_shoulder_is() -> None:
    """A hand is before its shoulder."""
    bent = pose(np.array([[0.0, -0.3, 0.0, 1.2]] * 2), yaw=0.7)
    for arm in (0, 3):
        joints = np.full((1, 2, 6, 3), np.nan)
        joints[:, :, arm : arm + 3] = bent[arm : arm + 3]
        other = 3 - arm
        result, _ = filled(joints)
        np.testing.assert_allclose(result[0, :, other], np.tile(bent[other], (2, 1)), atol=1e-9)


@pytest.mark.parametrize(("joint", "height"), [(1, 0.28), (2, 0.54)])
@pytest.mark.parametrize("right", [False, True])
def test_shoulder_of_an_arm_of_which_little_is_seen_is_above_it(
    joint: int, height: float, right: bool
) -> None:
    """The other is as far beside it as usual. A person of whom no more is known faces x."""
    place = np.array([0.3, -0.2, 1.0])
    joints = np.full((1, 2, 6, 3), np.nan)
    arm = 3 if right else 0
    joints[:, :, arm + joint] = place
    result, _ = filled(joints)
    np.testing.assert_allclose(result[0, :, arm], np.tile(place + [0.0, 0.0, height], (2, 1)))
    across = result[0, :, 0] - result[0, :, 3]
    assert np.linalg.norm(across, axis=1) == pytest.approx(0.36)
    if joint == 1:
        np.testing.assert_allclose(across, np.tile([0.0, 0.36, 0.0], (2, 1)), atol=1e-12)


@given(seeds)
def test_least_rotation_takes_start_to_end_and_keeps_lengths_and_angles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, end, vectors = rng.normal(size=(3, 5, 3))
    end *= (np.linalg.norm(start, axis=1) / np.linalg.norm(end, axis=1))[:, None]
    # opposite directions have no least rotation
    opposite = (start * end).sum(axis=1) < -0.99 * (start * start).sum(axis=1)
    end[opposite] = -end[opposite]
    np.testing.assert_allclose(rotated_between(start, end, start), end, rtol=1e-6, atol=1e-6)
    turned = rotated_between(start, end, vectors)
    size = np.linalg.norm(vectors, axis=1)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), size, rtol=1e-6)
    along = (vectors * start).sum(axis=1)
    np.testing.assert_allclose((turned * end).sum(axis=1), along, atol=1e-5)
    axis = np.cross(start, end)
    np.testing.assert_allclose(rotated_between(start, end, axis), axis, atol=1e-5)


@pytest.mark.parametrize("end", [[0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])
def test_opposite_or_no_direction_turns_nothing_and_divides_by_nothing(end: list[float]) -> None:
    start, vectors = np.array([[0.0, 0.0, 1.0]]), np.array([[0.1, 0.2, 0.3]])
    with np.errstate(all="raise"):
        turned = rotated_between(start, np.array([end]), vectors)
    assert np.isfinite(turned).all()
