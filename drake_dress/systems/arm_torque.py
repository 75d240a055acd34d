"""Torques of both arms' joints that vary with time alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem


class Wave(Protocol):
    """A function of time."""

    def value(self, time: float) -> float:
        """Returns the function at `time`, s."""


class ArmTorque(LeafSystem):
    """Applies to each arm constant torques times a function of time.

    .. pydrake_system::

        name: ArmTorque
        output_ports:
        - generalized_force

    generalized_force: (nv,) for the plant's applied generalized force, N·m; it depends on
    time only.

    Args:
        torque: (8,) at the left, then the right arm's joints, N·m.
        waves: Function of time of the left and of the right arm.
        velocity_count: nv of the plant.
        velocity_index: (8,) indices of the arms' joints in the plant's velocities.
    """

    def __init__(
        self,
        torque: np.ndarray,
        waves: Sequence[Wave],
        velocity_count: int,
        velocity_index: np.ndarray,
    ) -> None:
        super().__init__()
        self._waves = tuple(waves)
        self._torque = np.asarray(torque)
        self._count, self._index = velocity_count, np.asarray(velocity_index)
        self.DeclareVectorOutputPort(
            "generalized_force", velocity_count, self._calc, {self.time_ticket()}
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        time = context.get_time()
        force = np.zeros(self._count)
        force[self._index] = self._torque * np.repeat([w.value(time) for w in self._waves], 4)
        output.SetFromVector(force)
