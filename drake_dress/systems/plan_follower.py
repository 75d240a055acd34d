"""From plan to gripper commands at the command rate, with force kept in bounds."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.systems.global_mpc import TimedPlan


class PlanFollower(LeafSystem):
    """Integrates the plan's velocities to positions, and yields to force.

    .. pydrake_system::

        name: PlanFollower
        input_ports:
        - plan
        - left_gripper_position
        - right_gripper_position
        - left_gripper_force
        - right_gripper_force
        output_ports:
        - left_position_command
        - right_position_command

    Positions (3,), m; forces (3,) of the garment on the gripper, N. The part of a velocity that
    pulls against the garment's force fades out between half the limit and the limit; beyond, the
    gripper gives way along the force. A plan that has run out means rest.

    Args:
        start: (2,3) p_WG of left and right at time 0, m.
        period: of the commands, s.
        force_limit: N. yield_speed: at which a gripper gives way per 10 N beyond the limit, m/s.
        max_lead: a command is at most this far ahead of the gripper, m.
    """

    def __init__(
        self,
        start: np.ndarray,
        period: float,
        force_limit: float,
        yield_speed: float = 0.05,
        max_lead: float = 0.02,
    ) -> None:
        super().__init__()
        self._period = period
        self._force_limit = force_limit
        self._yield_speed = yield_speed
        self._max_lead = max_lead
        self._command = self.DeclareDiscreteState(np.concatenate([np.ravel(start), np.zeros(6)]))
        idle = TimedPlan(0.0, 1.0, np.zeros((1, 2, 3)))
        self.DeclareAbstractInputPort("plan", Value(idle))
        for name in ("position", "force"):
            for side in ("left", "right"):
                self.DeclareVectorInputPort(f"{side}_gripper_{name}", 3)
        for i, side in enumerate(("left", "right")):
            self.DeclareVectorOutputPort(
                f"{side}_position_command",
                3,
                self._calc(i),
                {self.discrete_state_ticket(self._command)},
            )
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        plan: TimedPlan = self.get_input_port(0).Eval(context)
        state = context.get_discrete_state(self._command).value()
        command, smooth = state[:6].reshape(2, 3).copy(), state[6:].reshape(2, 3).copy()
        step = int((context.get_time() - plan.start + 1e-9) / plan.time_step)
        velocity = plan.velocity[step] if 0 <= step < len(plan.velocity) else np.zeros((2, 3))
        for i in (0, 1):
            measured = self.get_input_port(1 + i).Eval(context)
            # low-pass of 50 ms: a gripper shall not answer to the garment's flutter
            smooth[i] += min(1.0, self._period / 0.05) * (
                self.get_input_port(3 + i).Eval(context) - smooth[i]
            )
            v = self._governed(velocity[i], smooth[i])
            command[i] += self._period * v
            lead = command[i] - measured
            distance = np.linalg.norm(lead)
            if distance > self._max_lead:
                command[i] = measured + lead * (self._max_lead / distance)
        discrete.set_value(self._command, np.concatenate([command.ravel(), smooth.ravel()]))

    def _governed(self, velocity: np.ndarray, force: np.ndarray) -> np.ndarray:
        size = float(np.linalg.norm(force))
        soft = 0.5 * self._force_limit
        if size <= soft:
            return velocity
        along = force / size
        pulling = float(velocity @ along)
        if pulling < 0.0:
            share = max(0.0, 1.0 - (size - soft) / (self._force_limit - soft))
            velocity = velocity - along * pulling * (1.0 - share)
        if size > self._force_limit:
            velocity = velocity + along * self._yield_speed * (size - self._force_limit) / 10.0
        return velocity

    def _calc(self, side: int):  # type: ignore[no-untyped-def]
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(
                context.get_discrete_state(self._command).value()[3 * side : 3 * side + 3]
            )

        return calc
