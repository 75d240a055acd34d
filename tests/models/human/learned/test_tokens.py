"""Tokens know neither place nor heading nor side, and of sleeves only what is known of them."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.learned.network import PERIOD
from drake_dress.models.human.learned.tokens import (
    SLEEVE_COLUMNS,
    TOKEN_COLUMNS,
    TOKEN_SIZE,
    ArmTokens,
    Windows,
    arm_tokens,
    place_on_arm,
)
from tests.models.human.learned.drawn import SWAPPED, Scene, drawn_scene

seeds = st.integers(0, 2**32 - 1)


def tokens_of(
    scene: Scene, seen: np.ndarray | None = None, shown: np.ndarray | None = None
) -> ArmTokens:
    steps = len(scene.joints)
    seen = np.ones((steps, 6), dtype=bool) if seen is None else seen
    shown = np.ones((steps, 2), dtype=bool) if shown is None else shown
    return arm_tokens(
        Windows(scene.joints[None], seen[None], scene.sleeves[None], shown[None], PERIOD)
    )


@given(seeds, st.floats(-3.0, 3.0))
def test_tokens_do_not_change_if_the_whole_scene_is_moved_and_turned(seed: int, yaw: float) -> None:
    scene = drawn_scene(seed)
    shift = np.random.default_rng(seed).normal(size=3)
    first, second = tokens_of(scene).tokens, tokens_of(scene.moved(yaw, shift)).tokens
    np.testing.assert_allclose(second, first, atol=2e-6)


@given(seeds)
def test_right_arm_of_a_mirrored_person_has_the_tokens_of_the_left(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = drawn_scene(seed)
    seen, shown = rng.random((20, 6)) < 0.7, rng.random((20, 2)) < 0.7
    found = tokens_of(scene, seen, shown).tokens
    image = tokens_of(scene.mirrored(), seen[:, SWAPPED], shown[:, ::-1]).tokens
    np.testing.assert_allclose(image, found[::-1], atol=2e-6)


@given(seeds)
def test_tokens_have_their_size_and_are_bounded_single_precision(seed: int) -> None:
    scene = drawn_scene(seed)
    found = tokens_of(Scene(50.0 * scene.joints, 9.0 * scene.sleeves)).tokens
    assert found.shape == (2, 20, TOKEN_SIZE)
    assert found.dtype == np.float32
    assert np.abs(found).max() <= 6.0


@given(seeds)
def test_columns_have_the_names_of_what_they_tell(seed: int) -> None:
    scene = drawn_scene(seed)
    joints = scene.joints.copy()
    joints[:, 5] += np.random.default_rng(seed).normal(size=(len(joints), 3))
    changed = (tokens_of(scene).tokens[0] != tokens_of(Scene(joints, scene.sleeves)).tokens[0]).any(
        axis=0
    )
    told = {name for name, columns in TOKEN_COLUMNS.items() if changed[columns].all()}
    assert told == {"other hand", "speed of the other hand", "other armhole, from its hand"}
    assert changed.sum() == 9


@given(seeds)
def test_only_the_columns_of_sleeves_tell_of_sleeves(seed: int) -> None:
    scene = drawn_scene(seed)
    arms = scene.joints.reshape(20, 2, 3, 3)
    higher = 0.5 * (arms[:, :, 0] + arms[:, :, 1]) + 0.03
    other = Scene(scene.joints, np.concatenate([higher, -scene.sleeves[:, :, 3:]], axis=2))
    changed = (tokens_of(scene).tokens != tokens_of(other).tokens).any(axis=(0, 1))
    rest = np.ones(TOKEN_SIZE, dtype=bool)
    rest[SLEEVE_COLUMNS] = False
    assert not changed[rest].any()
    # all but the two that say that sleeves are known
    assert changed[SLEEVE_COLUMNS].sum() == (~rest).sum() - 2


@given(seeds, st.floats(-100.0, 100.0))
def test_sleeves_that_are_not_known_leave_their_columns_zero(seed: int, fill: float) -> None:
    scene = drawn_scene(seed)
    unknown = np.zeros((20, 2), dtype=bool)
    found = tokens_of(Scene(scene.joints, np.full((20, 2, 6), fill)), None, unknown).tokens
    np.testing.assert_array_equal(found[:, :, SLEEVE_COLUMNS], 0.0)


@given(seeds, st.integers(1, 18))
def test_sleeve_that_comes_into_sight_has_no_speed_from_where_it_was_not(
    seed: int, since: int
) -> None:
    """What stands in the place of a sleeve that is not known does not change the tokens."""
    scene = drawn_scene(seed)
    shown = np.zeros((20, 2), dtype=bool)
    shown[since:] = True
    found = []
    for fill in (0.0, 5.0):
        sleeves = scene.sleeves.copy()
        sleeves[:since] = fill
        found.append(tokens_of(Scene(scene.joints, sleeves), None, shown).tokens)
    np.testing.assert_array_equal(found[0], found[1])
    whole = tokens_of(scene).tokens
    np.testing.assert_array_equal(found[0][:, since + 1 :], whole[:, since + 1 :])


@given(seeds)
def test_columns_of_visibility_tell_which_joints_are_seen(seed: int) -> None:
    scene = drawn_scene(seed)
    seen = np.random.default_rng(seed).random((20, 6)) < 0.5
    none = tokens_of(scene, np.zeros((20, 6), dtype=bool)).tokens
    some = tokens_of(scene, seen).tokens - none
    columns = np.flatnonzero(some.any(axis=(0, 1)))
    assert len(columns) == 4
    np.testing.assert_array_equal(some[0][:, columns], seen[:, [0, 1, 2, 5]])
    np.testing.assert_array_equal(some[1][:, columns], seen[:, [3, 4, 5, 2]])


def test_frames_are_those_of_now() -> None:
    found = tokens_of(drawn_scene(7)).tokens
    np.testing.assert_allclose(found[:, -1, :3], 0.0, atol=1e-6)
    assert np.abs(found[:, 0, :3]).max(axis=1).min() > 0.01
    # the other shoulder is to the right
    np.testing.assert_allclose(found[:, -1, 9], 0.0, atol=1e-6)
    assert (found[:, -1, 10] < -0.4).all()


def test_columns_have_their_scales() -> None:
    """Lengths of vectors do not depend on the frame."""
    scene = drawn_scene(8)
    found = np.linalg.norm(
        tokens_of(scene).tokens[:, :, :36].reshape(2, 20, 12, 3), axis=3
    )  # no columns of visibility
    sleeve = np.linalg.norm(tokens_of(scene).tokens[:, :, 37:40], axis=2)
    for side, own in enumerate((0, 3)):
        shoulder, elbow, hand = np.moveaxis(scene.joints[:, own : own + 3], 1, 0)
        other_hand = scene.joints[:, 5 - own]
        center = scene.sleeves[:, side, :3]
        vectors = {
            1: 3.0 * (elbow - shoulder),
            2: 3.0 * (hand - elbow),
            3: 1.5 * (scene.joints[:, 3 - own] - shoulder),
            4: 1.5 * (other_hand - shoulder),
        }
        for column, vector in vectors.items():
            np.testing.assert_allclose(
                found[side, :, column], np.linalg.norm(vector, axis=1), rtol=1e-4, atol=1e-5
            )
        for column, point, scale in ((6, elbow, 2.0), (7, hand, 2.0), (8, other_hand, 1.0)):
            speed = np.linalg.norm(np.diff(point, axis=0), axis=1) / PERIOD
            np.testing.assert_allclose(found[side, 1:, column], scale * speed, rtol=1e-3, atol=1e-5)
        away = np.linalg.norm(hand - hand[-1], axis=1)
        np.testing.assert_allclose(found[side, :, 9], 3.0 * away, rtol=1e-3, atol=1e-5)
        near = 3.0 * np.linalg.norm(center - hand, axis=1)
        np.testing.assert_allclose(sleeve[side], near, rtol=1e-3, atol=1e-5)


def test_person_at_rest_differs_from_one_who_moves_in_the_columns_of_motion_alone() -> None:
    scene = drawn_scene(3)
    rest = Scene(np.tile(scene.joints[-1], (20, 1, 1)), np.tile(scene.sleeves[-1], (20, 1, 1)))
    found = tokens_of(rest).tokens
    np.testing.assert_allclose(found, np.tile(found[:, -1:], (1, 20, 1)), atol=1e-6)
    np.testing.assert_allclose(found[:, :, :3], 0.0, atol=1e-6)
    np.testing.assert_allclose(found[:, :, 15:33], 0.0, atol=1e-6)


@given(seeds, st.floats(0.01, 1.99), st.floats(0.0, 0.05))
def test_place_on_arm_counts_from_hand_to_shoulder(seed: int, at: float, off: float) -> None:
    arm = drawn_scene(seed, 1).joints[0, :3]
    ends = arm[::-1]
    limb = min(int(at), 1)
    way = ends[limb + 1] - ends[limb]
    across = np.cross(way, arm[0] - arm[2])
    size = np.linalg.norm(across)
    aside = off * across / size if size > 1e-9 else np.zeros(3)
    point = ends[limb] + (at - limb) * way + aside
    place = place_on_arm(point, *arm)
    progress, distance = place
    nearest = place.of(list(arm[::-1]))
    np.testing.assert_allclose(np.linalg.norm(point - nearest), distance, atol=1e-12)
    assert distance <= np.linalg.norm(aside) + 1e-12
    # a point beside one limb of a bent arm may be as near to the other
    if distance > np.linalg.norm(aside) - 1e-9:
        assert abs(progress - at) < 1e-6
    else:
        assert (progress < 1.0) != (limb == 0)


def test_beyond_hand_and_shoulder_progress_ends_and_distance_goes_on() -> None:
    arm = np.array([[0.0, 0.0, 0.6], [0.0, 0.0, 0.3], [0.0, 0.0, 0.0]])
    points = np.array([[0.0, 0.0, -0.2], [0.0, 0.1, 1.0]])
    joints = np.tile(arm[:, None], (1, 2, 1))
    place = place_on_arm(points, *joints)
    progress, distance = place
    np.testing.assert_allclose(place.of(list(joints[::-1])), [arm[2], arm[0]])
    np.testing.assert_allclose(progress, [0.0, 2.0])
    np.testing.assert_allclose(distance, [0.2, np.hypot(0.1, 0.4)])


# Columns of a sleeve beside its arm: way from the axis, velocity less the arm's, and how fast
# sleeve and arm move in the direction of that way.
OFF, APART, SLEEVE, ARM = slice(48, 51), slice(51, 54), 54, 55


def led(sleeve: np.ndarray, arm: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Returns the tokens of a left arm in a sleeve, both moving at constant velocities, m/s."""
    time = PERIOD * np.arange(20)[:, None]
    scene = drawn_scene(4, 1)
    joints = scene.joints + (time * arm)[:, None]
    middle = 0.5 * (scene.joints[0, 1] + scene.joints[0, 2])
    sleeves = np.tile(scene.sleeves, (20, 1, 1))
    sleeves[:, 0, :3] = middle + beside + time * sleeve
    found: np.ndarray = tokens_of(Scene(joints, sleeves)).tokens[0]
    return found


def beside_the_forearm() -> np.ndarray:
    """Returns a way of 3 cm across the left forearm, m."""
    joints = drawn_scene(4, 1).joints[0]
    across = np.cross(joints[1] - joints[2], [0.0, 0.0, 1.0])
    way: np.ndarray = 0.03 * across / np.linalg.norm(across)
    return way


def test_sleeve_that_leads_and_arm_that_leads_have_other_signs() -> None:
    beside = beside_the_forearm()
    velocity = beside / 0.3
    leads = led(velocity, np.zeros(3), beside)
    # 0.1 m/s away from the axis, at 3 cm and more: most of 5 · 0.1
    assert 0.3 < leads[1, SLEEVE] < 0.5
    assert abs(leads[1, ARM]) < 1e-6
    follows = led(np.zeros(3), velocity, beside)
    assert follows[1, ARM] > 0.2
    assert abs(follows[1, SLEEVE]) < 1e-6
    withdraws = led(np.zeros(3), -velocity, beside)
    assert withdraws[1, ARM] < -0.3


def test_sleeve_that_goes_along_with_its_arm_does_not_move_beside_it() -> None:
    beside, velocity = beside_the_forearm(), np.array([0.1, -0.05, 0.2])
    tokens = led(velocity, velocity, beside)
    np.testing.assert_allclose(tokens[1:, APART], 0.0, atol=1e-6)
    np.testing.assert_allclose(tokens[1:, SLEEVE], tokens[1:, ARM], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(tokens[:, OFF], axis=1), 20.0 * 0.03, atol=1e-5)
