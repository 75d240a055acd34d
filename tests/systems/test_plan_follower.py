import numpy as np
import pytest
from pydrake.common.value import Value

from drake_dress.systems.global_mpc import TimedPlan
from drake_dress.systems.plan_follower import PlanFollower

LIMIT = 30.0


def commanded_speed(force: list[float], velocity: list[float], measured_at: float = 0.0) -> float:
    """Returns the speed of the left command along x after half a second."""
    follower = PlanFollower(np.zeros((2, 3)), 0.01, LIMIT, max_lead=10.0)
    context = follower.CreateDefaultContext()
    plan = TimedPlan(0.0, 10.0, np.tile(velocity, (1, 2, 1)))
    follower.get_input_port(0).FixValue(context, Value(plan))
    for side in ("left", "right"):
        follower.GetInputPort(f"{side}_gripper_position").FixValue(context, [measured_at, 0.0, 0.0])
        follower.GetInputPort(f"{side}_gripper_force").FixValue(context, force)
    x = []
    for _ in range(100):
        values = follower.EvalUniquePeriodicDiscreteUpdate(context)
        context.get_mutable_discrete_state_vector().SetFromVector(values.value())
        x.append(follower.GetOutputPort("left_position_command").Eval(context)[0])
    return (x[-1] - x[-2]) / 0.01


def test_without_force_the_plan_is_followed() -> None:
    assert commanded_speed([0, 0, 0], [0.1, 0, 0]) == pytest.approx(0.1)


def test_pulling_fades_out_as_force_rises() -> None:
    assert commanded_speed([-22.5, 0, 0], [0.1, 0, 0]) == pytest.approx(0.05, rel=0.01)
    assert commanded_speed([-LIMIT, 0, 0], [0.1, 0, 0]) == pytest.approx(0.0, abs=1e-3)


def test_beyond_the_limit_the_gripper_gives_way() -> None:
    assert commanded_speed([-40.0, 0, 0], [0.1, 0, 0]) < -0.01


def test_moving_with_the_force_is_not_held_back() -> None:
    assert commanded_speed([22.5, 0, 0], [0.1, 0, 0]) == pytest.approx(0.1)


def test_plan_that_has_run_out_means_rest() -> None:
    follower = PlanFollower(np.zeros((2, 3)), 0.01, LIMIT)
    context = follower.CreateDefaultContext()
    context.SetTime(5.0)
    plan = TimedPlan(0.0, 0.1, np.full((6, 2, 3), 0.1))
    follower.get_input_port(0).FixValue(context, Value(plan))
    for side in ("left", "right"):
        follower.GetInputPort(f"{side}_gripper_position").FixValue(context, [0, 0, 0])
        follower.GetInputPort(f"{side}_gripper_force").FixValue(context, [0, 0, 0])
    values = follower.EvalUniquePeriodicDiscreteUpdate(context)
    np.testing.assert_array_equal(values.value()[:6], 0.0)
