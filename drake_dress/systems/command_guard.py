"""An arm driver's check of its commands."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.arm.chain import JointLimits
from drake_dress.models.arm.command_guard import DriveState, follow


class CommandGuard(LeafSystem):
    """Follows valid joint commands and brakes on its own when commands are invalid.

    .. pydrake_system::

        name: CommandGuard
        input_ports:
        - position (where the mode has it)
        - velocity (where the mode has it)
        - fresh (optional)
        output_ports:
        - desired_state
        - position_commanded
        - velocity_commanded
        - stop

    Commands (7,) rad, rad/s. fresh: (1,) positive while commands keep arriving; assumed positive if
    not connected. desired_state: (14,) for a plant's drives. *_commanded: (7,) its two halves.
    stop: (1,) a `models.arm.command_guard.Stop`. Outputs depend on state only.

    Args:
        start: (7,) joints at time 0, rad.
        limits: Limits of the joints.
        period: Period of the discrete update, s.
        has_position, has_velocity: Whether the control mode commands this quantity.
    """

    def __init__(
        self,
        start: np.ndarray,
        limits: JointLimits,
        period: float,
        has_position: bool = True,
        has_velocity: bool = True,
    ) -> None:
        super().__init__()
        if not (has_position or has_velocity):
            raise ValueError("neither position nor velocity is commanded, expected one at least")
        self._limits, self._period = limits, period
        self._given = [
            name for name, has in (("position", has_position), ("velocity", has_velocity)) if has
        ]
        for name in self._given:
            self.DeclareVectorInputPort(name, 7)
        self.DeclareVectorInputPort("fresh", 1)
        self._state = self.DeclareDiscreteState(DriveState.at_rest(start).packed())
        ticket = {self.discrete_state_ticket(self._state)}
        for name, rows in (
            ("desired_state", slice(0, 14)),
            ("position_commanded", slice(0, 7)),
            ("velocity_commanded", slice(7, 14)),
            ("stop", slice(14, 15)),
        ):
            self.DeclareVectorOutputPort(name, rows.stop - rows.start, self._show(rows), ticket)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)
        # compile now: the first cycle must not wait seconds for it
        follow(DriveState.at_rest(start), start, np.zeros(7), True, limits, period)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        values = context.get_discrete_state(self._state).value()
        given = {name: self.GetInputPort(name).Eval(context) for name in self._given}
        fresh = self.GetInputPort("fresh")
        after = follow(
            DriveState.unpacked(values),
            given.get("position"),
            given.get("velocity"),
            not fresh.HasValue(context) or bool(fresh.Eval(context)[0] > 0.5),
            self._limits,
            self._period,
        )
        discrete.set_value(self._state, after.packed())

    def _show(self, rows: slice) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(context.get_discrete_state(self._state).value()[rows])

        return calc
