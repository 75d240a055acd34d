"""An arm whose tone does not carry it sags to where springs and weight balance."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.human.arm import Arm
from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.human.muscles import sagged
from drake_dress.models.sides import SIDES, Side

J = JointParameters()
WIDE = np.array([[-3.0] * 4, [3.0] * 4])
angles = st.tuples(
    st.floats(0.0, 1.2), st.floats(-1.0, 1.0), st.floats(-0.5, 0.5), st.floats(0, 1.5)
)


@settings(max_examples=25, deadline=None)
@given(pose=angles, tone=st.floats(0.0, 0.99), side=st.sampled_from(SIDES))
def test_springs_and_the_weight_that_is_not_carried_balance(
    pose: tuple[float, ...], tone: float, side: Side
) -> None:
    arm = Arm(BodyMeasures(), "standing", side)
    found = sagged(arm, np.array(pose), J.stiffness, tone, WIDE)
    torque = (1.0 - tone) * arm.gravity_torque(found) - J.stiffness * (found - pose)
    np.testing.assert_allclose(torque, 0.0, atol=1e-3)
    assert arm.potential(found) <= arm.potential(np.array(pose)) + 1e-9


@pytest.mark.parametrize("side", SIDES)
def test_less_tone_lets_it_hang_lower(side: Side) -> None:
    arm = Arm(BodyMeasures(), "standing", side)
    pose = np.deg2rad([40.0, 30.0, 0.0, 40.0])
    heights = [
        arm.hand(sagged(arm, pose, J.stiffness, tone, J.limits))[2] for tone in (1.0, 0.6, 0.3, 0.0)
    ]
    assert np.all(np.diff(heights) < -0.01)
    np.testing.assert_array_equal(sagged(arm, pose, J.stiffness, 1.0, J.limits), pose)


def test_without_springs_it_hangs_within_its_limits() -> None:
    arm = Arm(BodyMeasures(), "standing", "left")
    pose = np.deg2rad([40.0, 30.0, 0.0, 40.0])
    free = sagged(arm, pose, np.zeros(4), 0.0, J.limits)
    elbow, hand = arm.points(free)[1:]
    assert hand[2] == pytest.approx(arm.shoulder[2] - arm.length, abs=1e-3)
    assert elbow[2] > hand[2]
    stopped = np.array([[np.deg2rad(15.0), -2.6, -1.2, 0.0], [2.6, 1.2, 1.2, 2.5]])
    assert sagged(arm, pose, np.zeros(4), 0.0, stopped)[0] == pytest.approx(np.deg2rad(15.0))
