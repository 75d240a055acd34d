"""An arm's kinematics and weight, held against finite differences of its own energy."""

from collections.abc import Callable

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm import GRAVITY, Arm
from drake_dress.models.human.body import ArmMeasures, ArmPose, BodyMeasures, arm_points
from drake_dress.models.sides import SIDES, Side

M = BodyMeasures()
# tapered limbs, and a left arm that is shorter
UNLIKE = BodyMeasures(
    elbow_radius=0.035,
    wrist_radius=0.025,
    left=ArmMeasures(upper_arm_length=0.2, wrist_radius=0.02),
)
EPS = 1e-6


def some_angles(count: int = 6) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1.5, 1.5, (count, 4))


def potential(arm: Arm, angles: np.ndarray) -> float:
    """Returns m g z of both limbs' centres of mass, J."""
    shoulder, elbow, hand = arm.points(angles)
    of_upper, of_fore = arm.measures.arm_centers
    upper, fore = shoulder + of_upper * (elbow - shoulder), elbow + of_fore * (hand - elbow)
    heights = upper[2], fore[2]
    return GRAVITY * sum(m * z for m, z in zip(arm.measures.arm_masses, heights, strict=True))


def slope(of: Callable[[FloatArray], FloatArray | float], angles: np.ndarray) -> np.ndarray:
    return np.array([(of(angles + EPS * e) - of(angles - EPS * e)) / (2 * EPS) for e in np.eye(4)])


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("body", [M, UNLIKE])
def test_joints_are_where_the_body_model_has_them(side: Side, body: BodyMeasures) -> None:
    arm = Arm(body, "sitting", side)
    for q in some_angles():
        expected = arm_points(body, "sitting", side, ArmPose(*q))
        np.testing.assert_allclose(arm.points(q), expected, atol=1e-12)
        np.testing.assert_allclose(arm.hand(q), expected[2], atol=1e-12)


@pytest.mark.parametrize("side", SIDES)
def test_jacobian_is_the_derivative_of_the_hand(side: Side) -> None:
    arm = Arm(M, "standing", side)
    for q in some_angles():
        np.testing.assert_allclose(arm.jacobian(q), slope(arm.hand, q).T, atol=1e-8)


@pytest.mark.parametrize("side", SIDES)
def test_jacobian_of_the_elbow_is_its_derivative(side: Side) -> None:
    arm = Arm(M, "sitting", side)
    for q in some_angles():
        expected = slope(lambda a: arm.points(a)[1], q).T
        np.testing.assert_allclose(arm.elbow_jacobian(q), expected, atol=1e-8)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("body", [M, UNLIKE])
def test_gravity_torque_is_minus_the_slope_of_the_potential(side: Side, body: BodyMeasures) -> None:
    arm = Arm(body, "standing", side)
    for q in some_angles():
        expected = -slope(lambda a: potential(arm, a), q)
        np.testing.assert_allclose(arm.gravity_torque(q), expected, atol=1e-7)


@pytest.mark.parametrize("side", SIDES)
def test_gravity_stiffness_is_the_slope_of_its_torque(side: Side) -> None:
    arm = Arm(M, "standing", side)
    for q in some_angles():
        expected = -slope(arm.gravity_torque, q)
        np.testing.assert_allclose(arm.gravity_stiffness(q), expected, atol=1e-7)


def test_gravity_draws_a_hanging_arm_back_and_a_raised_one_away() -> None:
    arm = Arm(M, "standing", "left")
    assert arm.gravity_stiffness(np.zeros(4))[1, 1] > 5.0
    assert arm.gravity_stiffness(np.array([0.0, -np.pi, 0.0, 0.0]))[1, 1] < -5.0
