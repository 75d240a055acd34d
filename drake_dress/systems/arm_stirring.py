"""Small motions of a dressed person's arms."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.human.stirring import stirring_wave


class ArmStirring(LeafSystem):
    """Moves both arms a little from the time at which the grippers let go.

    .. pydrake_system::

        name: ArmStirring
        input_ports:
        - grippers_open
        output_ports:
        - generalized_force

    grippers_open: (1,) above 0.5 once both grippers have let go. generalized_force: (nv,) for the
    plant's applied generalized force, N·m; it depends on state and time only.

    Args:
        torque: (8,) amplitudes at the left, then the right arm's joints, N·m.
        frequency: Frequency of the motion, Hz.
        velocity_count: nv of the plant.
        velocity_index: (8,) indices of the arms' joints in the plant's velocities.
        period: Period of the discrete update, s.
    """

    def __init__(
        self,
        torque: np.ndarray,
        frequency: float,
        velocity_count: int,
        velocity_index: np.ndarray,
        period: float,
    ) -> None:
        super().__init__()
        self._torque, self._frequency = np.asarray(torque), frequency
        self._count, self._index = velocity_count, np.asarray(velocity_index)
        # time at which the grippers let go, s; infinite before
        self._since = self.DeclareDiscreteState([np.inf])
        self.DeclareVectorInputPort("grippers_open", 1)
        self.DeclareVectorOutputPort(
            "generalized_force", velocity_count, self._calc, {self.xd_ticket(), self.time_ticket()}
        )
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        since = float(context.get_discrete_state(self._since).value()[0])
        if np.isinf(since) and self.get_input_port(0).Eval(context)[0] > 0.5:
            since = context.get_time()
        discrete.set_value(self._since, [since])

    def _calc(self, context: Context, output: BasicVector) -> None:
        elapsed = context.get_time() - float(context.get_discrete_state(self._since).value()[0])
        force = np.zeros(self._count)
        force[self._index] = self._torque * np.repeat(stirring_wave(self._frequency, elapsed), 4)
        output.SetFromVector(force)
