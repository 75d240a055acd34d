"""The capsule person: its kinematics and its proportions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.body import (
    ArmPose,
    BodyMeasures,
    Posture,
    arm_points,
    arm_rotations,
    body_capsules,
    shoulder_height,
    shoulder_joint,
)
from drake_dress.models.sides import SIDES, Side

M = BodyMeasures()
POSTURES: tuple[Posture, Posture] = ("standing", "sitting")
OUT = {"left": 1.0, "right": -1.0}


def hand(side: Side, pose: ArmPose) -> FloatArray:
    return arm_points(M, "standing", side, pose)[2]


@pytest.mark.parametrize("side", SIDES)
def test_arm_at_zero_hangs_straight_down(side: Side) -> None:
    shoulder, elbow, tip = arm_points(M, "standing", side, ArmPose())
    np.testing.assert_allclose(shoulder, [0.0, OUT[side] * 0.18, 1.40])
    np.testing.assert_allclose(shoulder - elbow, [0.0, 0.0, M.upper_arm_length], atol=1e-15)
    np.testing.assert_allclose(elbow - tip, [0.0, 0.0, M.forearm_length], atol=1e-15)


@pytest.mark.parametrize("side", SIDES)
def test_signs_of_the_angles(side: Side) -> None:
    rest = hand(side, ArmPose())
    assert OUT[side] * (hand(side, ArmPose(abduction=0.3)) - rest)[1] > 0.1
    assert (hand(side, ArmPose(extension=0.3)) - rest)[0] < -0.1
    assert (hand(side, ArmPose(elbow_flexion=0.3)) - rest)[0] > 0.05
    bent = hand(side, ArmPose(elbow_flexion=1.5))
    turned = hand(side, ArmPose(elbow_flexion=1.5, rotation=0.3))
    assert OUT[side] * (turned - bent)[1] > 0.05


def test_equal_angles_give_mirrored_arms() -> None:
    pose = ArmPose(0.6, 0.4, -0.3, 0.8)
    left, right = (arm_points(M, "standing", side, pose) for side in SIDES)
    np.testing.assert_allclose(right, left * [1.0, -1.0, 1.0], atol=1e-15)


def test_limbs_keep_their_length_in_every_pose() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        pose = ArmPose(*rng.uniform(-3.0, 3.0, 4))
        for side in SIDES:
            shoulder, elbow, tip = arm_points(M, "sitting", side, pose)
            assert np.linalg.norm(elbow - shoulder) == pytest.approx(M.upper_arm_length)
            assert np.linalg.norm(tip - elbow) == pytest.approx(M.forearm_length)
            for rotation in arm_rotations(side, pose):
                np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
                assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_arm_moves_with_the_torso() -> None:
    pose = ArmPose(0.5, 0.2, 0.1, 0.4)
    turn, shift = Rotation.random(random_state=1).as_matrix(), np.array([0.3, -0.2, 0.1])
    still = arm_points(M, "standing", "left", pose)
    moved = arm_points(M, "standing", "left", pose, (turn, shift))
    np.testing.assert_allclose(moved, still @ turn.T + shift, atol=1e-14)


@pytest.mark.parametrize("posture", POSTURES)
def test_capsules_belong_to_the_five_bodies_and_stand_on_the_floor(posture: Posture) -> None:
    capsules = body_capsules(M, posture)
    assert {c.body for c in capsules} == {
        "torso",
        *(f"{side}_{limb}" for side in SIDES for limb in ("upper_arm", "forearm")),
    }
    lowest = min(min(c.a_B[2], c.b_B[2]) - c.radius for c in capsules if c.body == "torso")
    assert lowest == pytest.approx(0.0, abs=0.03)
    assert lowest >= 0.0
    assert all(c.radius > 0.0 for c in capsules)


@pytest.mark.parametrize("posture", POSTURES)
def test_trunk_is_as_wide_deep_and_long_as_measured(posture: Posture) -> None:
    top = shoulder_height(M, posture)
    # at the height of the breast, where the trunk alone is
    level = top - 0.2
    width, depth = 0.0, 0.0
    for c in body_capsules(M, posture):
        if c.body == "torso" and min(c.a_B[2], c.b_B[2]) <= level <= max(c.a_B[2], c.b_B[2]):
            width = max(width, abs(c.a_B[1]) + c.radius)
            depth = max(depth, abs(c.a_B[0]) + c.radius)
    assert 2 * width == pytest.approx(M.chest_width)
    assert 2 * depth == pytest.approx(M.chest_depth)


@pytest.mark.parametrize("posture", POSTURES)
@pytest.mark.parametrize("side", SIDES)
def test_open_arm_meets_the_trunk_only_near_its_shoulder(posture: Posture, side: Side) -> None:
    pose = ArmPose(abduction=np.deg2rad(30.0))
    shoulder, elbow, tip = arm_points(M, posture, side, pose)
    trunk = [c for c in body_capsules(M, posture) if c.body == "torso"]
    for share in np.linspace(0.3, 1.0, 8):
        for start, end, radius in (
            (shoulder, elbow, M.upper_arm_radius),
            (elbow, tip, M.forearm_radius),
        ):
            if share < 0.5 and start is shoulder:
                continue
            p = start + share * (end - start)
            for c in trunk:
                d = c.b_B - c.a_B
                t = np.clip((p - c.a_B) @ d / max(d @ d, 1e-12), 0.0, 1.0)
                assert np.linalg.norm(p - c.a_B - t * d) > c.radius + radius


def test_sitting_lowers_the_shoulders_and_keeps_arms_and_trunk() -> None:
    drop = shoulder_height(M, "standing") - shoulder_height(M, "sitting")
    assert drop == pytest.approx(0.5 * M.leg_length)
    for side in SIDES:
        lowered = shoulder_joint(M, "standing", side) - [0.0, 0.0, drop]
        np.testing.assert_allclose(shoulder_joint(M, "sitting", side), lowered)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"shoulder_width": -0.3}, "person: shoulder_width: is -0.3, expected a positive number"),
        ({"forearm_length": float("nan")}, "person: forearm_length: is nan"),
        ({"forearm_mass": 0.0}, "a positive number of kg"),
        ({"hand_radius": "wide"}, "person: hand_radius: is 'wide'"),
        ({"torso_length": 1.2}, "person: torso_length: is 1.2 m, expected less than"),
    ],
)
def test_impossible_measures_are_told(change: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        BodyMeasures(**change)


def test_unusable_angle_and_posture_are_told() -> None:
    with pytest.raises(UserError, match="arm: abduction: is inf"):
        ArmPose(abduction=float("inf"))
    with pytest.raises(UserError, match="posture: is 'lying', expected one of standing, sitting"):
        body_capsules(M, "lying")  # type: ignore[arg-type]  # that is what it is about
