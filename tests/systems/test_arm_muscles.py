import numpy as np
import pytest

from drake_dress.diagrams.person import person_arms
from drake_dress.models.human.body import ArmPose, BodyMeasures
from drake_dress.models.human.joints import JointParameters
from drake_dress.systems.arm_muscles import ArmMuscles

POSE = ArmPose(0.2, 0.8, 0.1, 0.3)
ARMS = person_arms(
    BodyMeasures(), "standing", {"left": POSE, "right": POSE}, JointParameters(6.0, 3.0, 3.6, 1.2)
)
# a plant of ten velocities in which the arms' joints come in a mixed order
INDEX = np.array([9, 1, 2, 3, 5, 6, 7, 8])
REST = ARMS.rest.ravel()


def force(set_point: np.ndarray, rate: np.ndarray | None = None) -> np.ndarray:
    system = ArmMuscles(ARMS, 10, INDEX)
    context = system.CreateDefaultContext()
    system.GetInputPort("set_point").FixValue(context, set_point)
    if rate is not None:
        system.GetInputPort("set_point_rate").FixValue(context, rate)
    return system.get_output_port().Eval(context)


def tone(set_point: np.ndarray) -> np.ndarray:
    both = set_point.reshape(2, 4)
    return -np.concatenate([a.gravity_torque(q) for a, q in zip(ARMS.arms, both, strict=True)])


def test_at_rest_only_the_weight_is_carried_and_other_joints_are_left_alone() -> None:
    torque = force(REST)
    np.testing.assert_allclose(torque[INDEX], tone(REST))
    np.testing.assert_array_equal(np.delete(torque, INDEX), 0.0)


def test_shifted_set_point_shifts_springs_and_carries_the_weight_there() -> None:
    shift = np.linspace(-0.3, 0.4, 8)
    expected = np.tile([6.0, 6.0, 6.0, 3.6], 2) * shift + tone(REST + shift)
    np.testing.assert_allclose(force(REST + shift)[INDEX], expected)


def test_damping_is_relative_to_the_set_point_and_to_rest_without_its_rate() -> None:
    rate = np.linspace(-1.0, 1.0, 8)
    more = force(REST, rate) - force(REST, np.zeros(8))
    np.testing.assert_allclose(more[INDEX], np.tile([3.0, 3.0, 3.0, 1.2], 2) * rate)
    np.testing.assert_array_equal(force(REST), force(REST, np.zeros(8)))


def test_limits_are_widened_to_a_pose_beyond_them() -> None:
    beyond = ArmPose(0.2, 0.8, 0.1, -0.05)
    arms = person_arms(
        BodyMeasures(),
        "standing",
        {"left": POSE, "right": beyond},
        JointParameters(2.0, 1.0, 1.5, 0.4),
    )
    assert arms.limits[1, 0, 3] == pytest.approx(-0.05)
    assert arms.limits[0, 0, 3] == 0.0
