"""The controller's person goes with the shoulders, wherever they have turned."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.control.person_model import kept_away, person_obstacles
from drake_dress.models.human.body import (
    ArmPose,
    body_capsules,
)
from tests.plain_person import M, plain_joints, plain_person

POSE = ArmPose(0.25, 0.8, 0.0, 0.2)
HORIZON = 3
STEP = 0.1
PERSON = plain_person("sitting")


def frame(yaw: float, place: tuple[float, float] = (0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.array([*place, 0.0])


def joints(yaw: float = 0.0, place: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    return plain_joints("sitting", POSE, frame(yaw, place))


def test_person_who_faces_forward_is_where_the_capsules_say() -> None:
    torso = [c for c in body_capsules(M, "sitting") if c.body == "torso"]
    seen = person_obstacles(PERSON, np.stack([joints()] * (HORIZON + 1)), STEP)
    for obstacles in seen:
        np.testing.assert_allclose(obstacles.a[: len(torso)], [c.a_B for c in torso], atol=1e-12)
        np.testing.assert_allclose(obstacles.b[: len(torso)], [c.b_B for c in torso], atol=1e-12)
        np.testing.assert_array_equal(obstacles.velocity, 0.0)


@pytest.mark.parametrize("yaw", [-0.5, 0.26, 2.0])
def test_torso_turns_with_the_shoulders(yaw: float) -> None:
    """Knees of a person who sits are in front of the hips, wherever front is."""
    place = (0.3, -0.2)
    rotation, origin = frame(yaw, place)
    ahead = person_obstacles(PERSON, np.stack([joints()] * (HORIZON + 1)), STEP)[0]
    turned = person_obstacles(PERSON, np.stack([joints(yaw, place)] * (HORIZON + 1)), STEP)[0]
    np.testing.assert_allclose(turned.a, ahead.a @ rotation.T + origin, atol=1e-12)
    np.testing.assert_allclose(turned.b, ahead.b @ rotation.T + origin, atol=1e-12)


def test_torso_that_is_predicted_to_turn_moves_as_it_does() -> None:
    """Over a step, ends of capsules go where their velocity and rotation carry them."""
    rows = [joints(0.05 * j) for j in range(HORIZON + 1)]
    predicted = person_obstacles(PERSON, np.stack(rows), STEP)
    for now, then in itertools.pairwise(predicted):
        np.testing.assert_allclose(now.a + STEP * now.velocity, then.a, atol=1e-12)
    knee = int(np.argmax(predicted[0].a[:, 0]))
    assert np.linalg.norm(predicted[0].velocity[knee]) == pytest.approx(
        0.5 * np.linalg.norm(predicted[0].a[knee, :2]), rel=0.01
    )


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 3.0))
def test_person_is_kept_away_from_by_a_share_of_the_radii(seed: int, share: float) -> None:
    """A limb is as uncertain as the less certain of its ends, the torso as the shoulders."""
    radius = np.random.default_rng(seed).uniform(0.0, 0.2, (HORIZON + 1, 6))
    seen = person_obstacles(PERSON, np.stack([joints(0.1 * j) for j in range(HORIZON + 1)]), STEP)
    wider = kept_away(seen, radius, share)
    assert len(wider) == HORIZON
    for before, after, r in zip(seen, wider, radius, strict=False):
        # both ends of a limb by the same
        grown, at_end = ((after.radius - before.radius) / max(share, 1e-9)).T
        np.testing.assert_allclose(at_end, grown, atol=1e-6)
        if share > 1e-6:
            torso, left, right = grown[:-6], grown[-6:-3], grown[-3:]
            np.testing.assert_allclose(torso, 0.5 * (r[0] + r[3]), rtol=1e-6, atol=1e-9)
            for arm, (shoulder, elbow, hand) in ((left, r[:3]), (right, r[3:])):
                limbs = [max(shoulder, elbow), max(elbow, hand), hand]
                np.testing.assert_allclose(arm, limbs, rtol=1e-6, atol=1e-9)
        for name in ("a", "b", "velocity", "angular_velocity"):
            np.testing.assert_array_equal(getattr(after, name), getattr(before, name))


def test_person_who_is_certain_or_a_share_of_zero_changes_nothing() -> None:
    seen = person_obstacles(PERSON, np.stack([joints()] * (HORIZON + 1)), STEP)
    for radius, share in ((0.0, 1.0), (0.3, 0.0)):
        same = kept_away(seen, np.full((HORIZON + 1, 6), radius), share)
        for before, after in zip(seen, same, strict=True):
            np.testing.assert_array_equal(after.radius, before.radius)
