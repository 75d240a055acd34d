"""The arm that can do less of what a second sleeve needs is found, whatever is wrong with it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.human.ability import are_alike, reachable_hands, room_for_second
from drake_dress.models.human.arm import Arm, Arms
from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.sides import SIDES, Side

M = BodyMeasures()
REST = np.deg2rad([[13.0, 46.0, 0.0, 10.0]] * 2)
REACH = 0.52
ABLE = JointParameters()


def arms(joints: JointParameters, rest: np.ndarray = REST) -> Arms:
    own = [joints.of(side) for side in SIDES]
    left, right = (Arm(M, "standing", side) for side in SIDES)
    return Arms(
        (left, right),
        rest,
        np.stack([j.limits for j in own]),
        np.stack([j.stiffness for j in own]),
        np.stack([j.damping for j in own]),
        (own[0].tone > 0.0, own[1].tone > 0.0),
    )


def rooms(joints: JointParameters, from_front: bool = False) -> list[float]:
    return [room_for_second(arms(joints), side, REACH, from_front) for side in (0, 1)]


def angles(low: float, high: float) -> tuple[float, float]:
    return float(np.deg2rad(low)), float(np.deg2rad(high))


WEAK = {
    "stiff elbow": replace(ABLE, elbow_limits=angles(65.0, 75.0)),
    "stiff shoulder": replace(ABLE, extension_limits=angles(-60.0, 10.0)),
    "paralysed": replace(ABLE, tone=0.0),
}


def test_equal_arms_have_equal_room() -> None:
    both = arms(ABLE)
    assert are_alike(both)
    left, right = rooms(ABLE)
    assert left == pytest.approx(right, rel=0.05)
    assert left > 0.01


@pytest.mark.parametrize("what", WEAK)
@pytest.mark.parametrize("side", SIDES)
def test_an_impaired_arm_has_less_room_on_either_side(what: str, side: Side) -> None:
    own = WEAK[what]
    joints = replace(ABLE, left=own) if side == "left" else replace(ABLE, right=own)
    weak = SIDES.index(side)
    found = rooms(joints)
    assert not are_alike(arms(joints))
    assert found[weak] < 0.5 * found[1 - weak]


def test_an_arm_without_tone_is_where_it_rests() -> None:
    both = arms(replace(ABLE, right=WEAK["paralysed"]))
    np.testing.assert_allclose(reachable_hands(both, 1), [both.arms[1].hand(REST[1])])


def test_an_arm_that_does_not_go_back_has_room_in_front() -> None:
    joints = replace(ABLE, right=WEAK["stiff shoulder"])
    assert rooms(joints)[1] == 0.0
    assert rooms(joints, from_front=True)[1] > 0.01


@settings(max_examples=15, deadline=None)
@given(low=st.floats(-1.5, 0.5), width=st.floats(0.05, 0.6), elbow=st.floats(0.2, 2.0))
def test_hands_are_within_the_joints_ranges(low: float, width: float, elbow: float) -> None:
    """Each place that counts is one that the arm's own kinematics reach within the limits."""
    joints = replace(
        ABLE,
        abduction_limits=(0.1, 0.1 + width),
        extension_limits=(low, low + width),
        rotation_limits=(-0.1, 0.1),
        elbow_limits=(elbow, elbow + 0.1),
    )
    hands = reachable_hands(arms(joints), 0)
    arm = Arm(M, "standing", "left")
    reach = np.linalg.norm(hands - arm.shoulder, axis=1)
    # the law of cosines for the least and the largest flexion
    a, b = M.upper_arm_length, M.forearm_length
    far, near = (np.sqrt(a**2 + b**2 + 2 * a * b * np.cos(k)) for k in (elbow, elbow + 0.1))
    assert np.all((reach < far + 1e-9) & (reach > near - 1e-9))
    assert np.ptp(hands, axis=0).max() < (a + b) * (3 * width + 0.4)
