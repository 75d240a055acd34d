"""Estimate of the external torques on an arm's joints."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem


class ExternalTorque(LeafSystem):
    """Estimates the external torques on an arm's joints, as the arm's own controller does.

    .. pydrake_system::

        name: ExternalTorque
        input_ports:
        - state
        - torque_measured
        output_ports:
        - torque_external

    state: (14,) joints, rad, rad/s. torque_measured: (7,) of the drives, N·m. torque_external: (7,)
    N·m, positive if the surroundings push a joint in its positive direction: M(q) dv/dt + C(q,v) v
    minus the measured torque, low-pass filtered. Gravity is compensated by the arm itself.

    Args:
        arm: Continuous plant with the arm alone, without gravity.
        period: Period of the estimate, s.
        filter_time: Time constant of the low-pass filter, s.
    """

    def __init__(self, arm: MultibodyPlant, period: float, filter_time: float) -> None:
        super().__init__()
        self._arm, self._period = arm, period
        self._share = min(1.0, period / filter_time) if filter_time > 0.0 else 1.0
        self._context = arm.CreateDefaultContext()
        self._none = MultibodyForces(arm)
        # previous velocities, the estimate, and whether previous velocities exist
        self._memory = self.DeclareDiscreteState(np.zeros(15))
        self.DeclareVectorInputPort("state", 14)
        self.DeclareVectorInputPort("torque_measured", 7)
        self.DeclareVectorOutputPort(
            "torque_external", 7, self._calc, {self.discrete_state_ticket(self._memory)}
        )
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        memory = context.get_discrete_state(self._memory).value()
        state = self.GetInputPort("state").Eval(context)
        last, estimate = memory[:7], memory[7:14]
        q, v = state[:7], state[7:]
        if memory[14] > 0.5:
            self._arm.SetPositions(self._context, q)
            self._arm.SetVelocities(self._context, v)
            needed = self._arm.CalcInverseDynamics(
                self._context, (v - last) / self._period, self._none
            )
            felt = needed - self.GetInputPort("torque_measured").Eval(context)
            estimate = estimate + self._share * (felt - estimate)
        discrete.set_value(self._memory, np.concatenate([v, estimate, [1.0]]))

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._memory).value()[7:14])
