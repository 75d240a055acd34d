"""An arm's angles are found again from where its limbs point."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.human.arm_angles import arm_angles
from drake_dress.models.human.body import ArmPose, arm_rotations
from drake_dress.models.sides import SIDES, Side

DOWN = np.array([0.0, 0.0, -1.0])


@given(
    st.sampled_from(SIDES),
    st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3), st.floats(0.0, 3.0)),
)
def test_both_sets_of_angles_point_the_limbs_alike(
    side: Side, angles: tuple[float, float, float, float]
) -> None:
    upper, fore = (r @ DOWN for r in arm_rotations(side, ArmPose(*angles)))
    for found in arm_angles(side, upper, fore):
        again = arm_rotations(side, ArmPose(*(float(a) for a in found)))
        np.testing.assert_allclose(again[0] @ DOWN, upper, atol=1e-7)
        np.testing.assert_allclose(again[1] @ DOWN, fore, atol=1e-7)


@given(
    st.sampled_from(SIDES),
    st.tuples(st.floats(-3, 3), st.floats(-1.5, 1.5), st.floats(-3, 3), st.floats(0.1, 3.0)),
)
def test_one_of_both_sets_is_the_one_that_was_set(
    side: Side, angles: tuple[float, float, float, float]
) -> None:
    upper, fore = (r @ DOWN for r in arm_rotations(side, ArmPose(*angles)))
    off = arm_angles(side, upper, fore) - np.array(angles)
    off = (off + np.pi) % (2.0 * np.pi) - np.pi
    assert np.abs(off).max(axis=1).min() < 1e-5
