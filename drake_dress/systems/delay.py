"""A delayed vector signal."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    OutputPort,
)

from drake_dress.models.arrays import FloatArray


class Delay(LeafSystem):
    """Delays a vector by a whole number of periods.

    .. pydrake_system::

        name: Delay
        input_ports:
        - value
        output_ports:
        - delayed_value

    Both (k,). Until the first delay has passed, the output is `start`. (Drake's DiscreteTimeDelay
    starts from zero, which is not a valid gripper position.)

    Args:
        start: (k,) initial output.
        period: Sample period, s.
        delay: Delay, rounded to a whole number of periods, at least one, s.
    """

    def __init__(self, start: FloatArray, period: float, delay: float) -> None:
        super().__init__()
        size = len(start)
        self._size, steps = size, max(1, round(delay / period))
        self._line = self.DeclareDiscreteState(np.tile(start, steps))
        self.DeclareVectorInputPort("value", size)
        self.DeclareVectorOutputPort(
            "delayed_value", size, self._calc, {self.discrete_state_ticket(self._line)}
        )
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        line = context.get_discrete_state(self._line).value()
        value = self.get_input_port(0).Eval(context)
        discrete.set_value(self._line, np.concatenate([line[self._size :], value]))

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._line).value()[: self._size])


def delayed(
    builder: DiagramBuilder, port: OutputPort, start: FloatArray, period: float, delay: float
) -> OutputPort:
    """Returns `port` delayed by a `Delay`, or `port` itself if the delay, s, is not positive."""
    if delay <= 0.0:
        return port
    line = builder.AddSystem(Delay(start, period, delay))
    builder.Connect(port, line.get_input_port())
    return line.get_output_port()
