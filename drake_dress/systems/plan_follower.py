"""Gripper velocities from a plan."""

from __future__ import annotations

from collections.abc import Callable

from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_dress.models.control.local_control import GlobalPlan
from drake_dress.models.sides import SIDES


class PlanFollower(LeafSystem):
    """Requests the plan's velocity at the current time.

    .. pydrake_system::

        name: PlanFollower
        input_ports:
        - plan
        output_ports:
        - left_velocity_request
        - right_velocity_request
        - request_time

    Requests (3,) m/s; request_time (1,) time of the requests, s: now. Before the plan starts and
    after it ends, the requests are zero. The system has no state and does not integrate the
    tracking error, so it cannot wind up while the grippers are held back.
    """

    def __init__(self) -> None:
        super().__init__()
        plan = self.DeclareAbstractInputPort("plan", Value(GlobalPlan.resting()))
        ticket = {self.input_port_ticket(plan.get_index()), self.time_ticket()}
        for i, side in enumerate(SIDES):
            self.DeclareVectorOutputPort(f"{side}_velocity_request", 3, self._calc(i), ticket)
        self.DeclareVectorOutputPort("request_time", 1, self._calc_time, {self.time_ticket()})

    def _calc(self, side: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            plan: GlobalPlan = self.get_input_port(0).Eval(context)
            output.SetFromVector(plan.velocity_at(context.get_time())[side])

        return calc

    def _calc_time(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([context.get_time()])
