"""Joints of each arm: those of both, or its own."""

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.human.joints import JointParameters


def test_an_arm_has_its_own_joints_where_they_are_given() -> None:
    own = JointParameters(elbow_limits=(1.0, 1.2), elbow_stiffness=20.0, tone=0.0)
    both = replace(JointParameters(), right=own)
    assert both.of("left") is both
    assert both.of("right") is own


def test_arrays_are_in_the_order_of_the_joints() -> None:
    j = JointParameters(1.0, 2.0, 3.0, 4.0, (0.0, 0.1), (0.2, 0.3), (0.4, 0.5), (0.6, 0.7))
    np.testing.assert_array_equal(j.stiffness, [1.0, 1.0, 1.0, 3.0])
    np.testing.assert_array_equal(j.damping, [2.0, 2.0, 2.0, 4.0])
    np.testing.assert_array_equal(j.limits, [[0.0, 0.2, 0.4, 0.6], [0.1, 0.3, 0.5, 0.7]])


@pytest.mark.parametrize("tone", [-0.1, 1.1, float("nan"), "0", True])
def test_tone_is_a_share(tone: object) -> None:
    with pytest.raises(UserError, match="tone"):
        JointParameters(tone=tone)  # type: ignore[arg-type]
