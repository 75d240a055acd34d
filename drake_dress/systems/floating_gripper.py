"""A free-floating gripper with limited speed and acceleration."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.arrays import FloatArray


class FloatingGripper(LeafSystem):
    """Stands in for an arm's end effector: position control with limited speed and acceleration.

    .. pydrake_system::

        name: FloatingGripper
        input_ports:
        - position_command
        output_ports:
        - position_measured
        - velocity_measured

    position_command: (3,) desired p_WG, m. position_measured, velocity_measured: (3,) m, m/s;
    they depend on state only, without feedthrough. On a non-finite command the gripper stops.

    Args:
        start: (3,) p_WG at time 0, m.
        period: Period of the discrete update, s.
        max_speed: Speed limit, m/s. max_acceleration: Acceleration limit, m/s².
    """

    def __init__(
        self, start: FloatArray, period: float, max_speed: float, max_acceleration: float
    ) -> None:
        super().__init__()
        self._period = period
        self._max_speed = max_speed
        self._max_acceleration = max_acceleration
        self._state = self.DeclareDiscreteState(np.concatenate([start, np.zeros(3)]))
        self.DeclareVectorInputPort("position_command", 3)
        self.DeclareVectorOutputPort(
            "position_measured", 3, self._calc_position, {self.discrete_state_ticket(self._state)}
        )
        self.DeclareVectorOutputPort(
            "velocity_measured", 3, self._calc_velocity, {self.discrete_state_ticket(self._state)}
        )
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        state = context.get_discrete_state(self._state).value()
        position, velocity = state[:3], state[3:]
        command = self.get_input_port(0).Eval(context)
        wanted = np.zeros(3)
        if np.all(np.isfinite(command)):
            offset = command - position
            distance = np.linalg.norm(offset)
            if distance > 1e-9:
                # highest speed from which the gripper can still stop at the command
                brake = np.sqrt(self._max_acceleration * distance)
                speed = min(self._max_speed, distance / self._period, brake)
                wanted = offset / distance * speed
        change = wanted - velocity
        size = np.linalg.norm(change)
        limit = self._max_acceleration * self._period
        if size > limit:
            change *= limit / size
        velocity = velocity + change
        discrete.set_value(
            self._state, np.concatenate([position + self._period * velocity, velocity])
        )

    def _calc_position(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._state).value()[:3])

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._state).value()[3:])
