"""The cue arrives as it was sent, and wrong messages are told."""

from __future__ import annotations

from drake import lcmt_robot_state

from drake_dress.models.supervision.fault import Fault
from drake_dress.systems.cue_messages import NAME, CueReceiver, CueSender, check_cue
from drake_dress.systems.lcm_inbox import Received


def test_it_arrives_as_it_was_sent() -> None:
    sender, receiver = CueSender(), CueReceiver()
    sending, receiving = sender.CreateDefaultContext(), receiver.CreateDefaultContext()
    receiver.get_input_port().FixValue(receiving, Received())
    assert receiver.get_output_port().Eval(receiving)[0] == 0.0
    for value in (0.0, 1.0):
        sender.get_input_port().FixValue(sending, [value])
        message = sender.get_output_port().Eval(sending)
        again = lcmt_robot_state.decode(message.encode())
        assert not check_cue(again).fault
        receiver.get_input_port().FixValue(receiving, Received(again))
        assert receiver.get_output_port().Eval(receiving)[0] == value


def test_wrong_messages_are_told() -> None:
    def message(name: str, *values: float) -> lcmt_robot_state:
        made = lcmt_robot_state()
        made.joint_name, made.joint_position = [name] * len(values), list(values)
        made.num_joints = len(values)
        return made

    assert check_cue(message("shoulder", 1.0)).fault == Fault.WRONG_SIZE
    assert check_cue(message(NAME, 1.0, 0.0)).fault == Fault.WRONG_SIZE
    assert check_cue(message(NAME, float("nan"))).fault == Fault.NOT_FINITE
