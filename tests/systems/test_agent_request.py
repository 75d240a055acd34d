import numpy as np

from drake_dress.models.sides import SIDES
from drake_dress.systems.agent_request import AgentRequest


def test_each_gripper_is_asked_for_its_part_now() -> None:
    agent = AgentRequest()
    context = agent.CreateDefaultContext()
    for time, velocity in ((0.0, np.arange(6.0)), (2.5, -np.arange(6.0))):
        context.SetTime(time)
        agent.get_input_port().FixValue(context, velocity)
        asked = [agent.GetOutputPort(f"{side}_velocity_request").Eval(context) for side in SIDES]
        np.testing.assert_array_equal(asked, velocity.reshape(2, 3))
        assert agent.GetOutputPort("request_time").Eval(context) == [time]
