import numpy as np
import pytest
from pydrake.common.value import Value

from drake_dress.models.control.local_control import GlobalPlan
from drake_dress.systems.plan_follower import PlanFollower

PLAN = GlobalPlan(1.0, 0.1, np.arange(18.0).reshape(3, 2, 3), np.zeros((4, 2, 3)))


def asked_at(time: float) -> np.ndarray:
    """Returns (2,3) what is asked for under `PLAN`."""
    follower = PlanFollower()
    context = follower.CreateDefaultContext()
    follower.get_input_port(0).FixValue(context, Value(PLAN))
    context.SetTime(time)
    assert follower.GetOutputPort("request_time").Eval(context) == [time]
    return np.stack(
        [follower.GetOutputPort(f"{s}_velocity_request").Eval(context) for s in ("left", "right")]
    )


@pytest.mark.parametrize(("time", "row"), [(1.0, 0), (1.09, 0), (1.1, 1), (1.2999, 2)])
def test_each_velocity_of_the_plan_is_asked_for_in_its_time(time: float, row: int) -> None:
    np.testing.assert_array_equal(asked_at(time), PLAN.velocity[row])


@pytest.mark.parametrize("time", [0.0, 0.95, 1.3, 50.0])
def test_plan_that_does_not_run_means_rest(time: float) -> None:
    np.testing.assert_array_equal(asked_at(time), 0.0)


def test_request_changes_with_time_alone() -> None:
    follower = PlanFollower()
    context = follower.CreateDefaultContext()
    follower.get_input_port(0).FixValue(context, Value(PLAN))
    port = follower.GetOutputPort("left_velocity_request")
    for k in range(3):
        context.SetTime(1.05 + 0.1 * k)
        np.testing.assert_array_equal(port.Eval(context), PLAN.velocity[k, 0])
