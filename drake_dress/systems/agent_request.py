"""Gripper velocities requested from outside the diagram."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_dress.models.sides import SIDES


class AgentRequest(LeafSystem):
    """Passes an agent's velocity requests on to the safety governor.

    .. pydrake_system::

        name: AgentRequest
        input_ports:
        - velocity
        output_ports:
        - left_velocity_request
        - right_velocity_request
        - request_time

    velocity: (6,) of left, then right gripper in W, m/s. Requests (3,) m/s; request_time (1,), the
    current time, s. An agent acts at its own rate and a request holds until the next one, so
    requests do not age. The caller that steps the diagram must set each new request in time.
    """

    def __init__(self) -> None:
        super().__init__()
        velocity = self.DeclareVectorInputPort("velocity", 6)
        ticket = {self.input_port_ticket(velocity.get_index())}
        for i, side in enumerate(SIDES):
            self.DeclareVectorOutputPort(f"{side}_velocity_request", 3, self._calc(i), ticket)
        self.DeclareVectorOutputPort("request_time", 1, self._calc_time, {self.time_ticket()})

    def _calc(self, side: int):  # type: ignore[no-untyped-def]
        def calc(context: Context, output: BasicVector) -> None:
            velocity = self.get_input_port(0).Eval(context)
            output.SetFromVector(velocity[3 * side : 3 * side + 3])

        return calc

    def _calc_time(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([context.get_time()])
