import numpy as np
from pydrake.systems.analysis import Simulator

from drake_dress.diagrams.person import person_arms
from drake_dress.models.human.body import ArmPose, BodyMeasures
from drake_dress.models.human.following import FollowingParameters
from drake_dress.models.human.joints import JointParameters
from drake_dress.systems.passive_person import PassivePerson

POSE = ArmPose(0.2, 0.8, 0.1, 0.3)
ARMS = person_arms(
    BodyMeasures(), "standing", {"left": POSE, "right": POSE}, JointParameters(6.0, 3.0, 3.6, 1.2)
)
REST = ARMS.rest.ravel()
# a person of nine joints, the first of which is no arm's
DOFS = np.arange(1, 9)


def person(**following: float) -> PassivePerson:
    return PassivePerson(ARMS, 9, DOFS, FollowingParameters(**following), 0.004)


def held(system: PassivePerson, angles: np.ndarray, duration: float) -> np.ndarray:
    """Returns the set-point (8,) after the arms were held at `angles` (8,) for so long, s."""
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    state = np.concatenate([[0.7], angles, np.full(9, 3.0)])
    system.GetInputPort("person_state").FixValue(context, state)
    simulator.AdvanceTo(duration)
    return system.get_output_port().Eval(context)


def test_set_point_begins_and_stays_at_rest() -> None:
    np.testing.assert_array_equal(held(person(), REST, 0.5), REST)


def test_the_arm_that_is_led_is_followed_and_the_other_is_not() -> None:
    led = REST + np.array([0.5, -0.2, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0])
    set_point = held(person(time_constant=0.2), led, 3.0)
    assert np.linalg.norm(set_point[:4] - led[:4]) < 0.2 * np.linalg.norm(led - REST)
    np.testing.assert_array_equal(set_point[4:], REST[4:])


def test_set_point_stays_within_the_joints_limits() -> None:
    low, high = ARMS.limits[:, 0].ravel(), ARMS.limits[:, 1].ravel()
    set_point = held(person(time_constant=0.1, max_speed=5.0), high + 1.0, 3.0)
    assert (set_point <= high + 1e-12).all()
    assert (set_point >= low).all()
    assert np.abs(set_point - high).max() < 0.05


def test_set_point_depends_on_the_past_alone() -> None:
    assert not person().HasAnyDirectFeedthrough()
