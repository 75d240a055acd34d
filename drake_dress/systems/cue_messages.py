"""The cue to lower the arms, as `lcmt_robot_state` with one value of that name.

A loudspeaker, or whoever stands beside the person, passes it on: the arms may be lowered.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from drake import lcmt_robot_state
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_dress.models.supervision.fault import SOUND, Fault, Finding
from drake_dress.systems.lcm_inbox import Received

NAME = "both_sleeves_on"


def check_cue(message: Any) -> Finding:
    """Returns what is wrong with a cue: another name, another number of values, or no number."""
    if list(message.joint_name) != [NAME] or len(message.joint_position) != 1:
        return Finding(Fault.WRONG_SIZE)
    return SOUND if np.isfinite(message.joint_position[0]) else Finding(Fault.NOT_FINITE)


class CueSender(LeafSystem):
    """Makes the message of a cue.

    .. pydrake_system::

        name: CueSender
        input_ports:
        - cue
        output_ports:
        - message

    cue: (1,) above 0.5 while the person is to lower the arms. message: lcmt_robot_state.
    """

    def __init__(self) -> None:
        super().__init__()
        self.DeclareVectorInputPort("cue", 1)
        self.DeclareAbstractOutputPort("message", lambda: Value(lcmt_robot_state()), self._calc)

    def _calc(self, context: Context, output: AbstractValue) -> None:
        message = lcmt_robot_state()
        message.utime = round(1e6 * context.get_time())
        message.num_joints = 1
        message.joint_name = [NAME]
        message.joint_position = [float(self.get_input_port(0).Eval(context)[0] > 0.5)]
        output.set_value(message)


class CueReceiver(LeafSystem):
    """Outputs the cue of the last sound message.

    .. pydrake_system::

        name: CueReceiver
        input_ports:
        - received
        output_ports:
        - cue

    received: `Received` of lcmt_robot_state. cue: (1,) 0 before the first message.
    """

    def __init__(self) -> None:
        super().__init__()
        self.DeclareAbstractInputPort("received", Value(Received()))
        self.DeclareVectorOutputPort("cue", 1, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        received: Received = self.get_input_port(0).Eval(context)
        message = received.message
        output.SetFromVector([0.0 if message is None else float(message.joint_position[0])])
