"""Tremor of the arms."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_dress.models.human.tremor import TremorWave


class HandTremor(LeafSystem):
    """Applies tremor torques to both arms, independently; see `models/human/tremor.py`.

    .. pydrake_system::

        name: HandTremor
        output_ports:
        - generalized_force

    generalized_force: (nv,) for the plant's applied generalized force, N·m; it depends on
    time only.

    Args:
        torque: (8,) amplitudes at the left, then the right arm's joints, N·m.
        frequency: Mean frequency, Hz.
        seed: Seed of phases and frequency drift; equal seeds give equal tremor.
        velocity_count: nv of the plant.
        velocity_index: (8,) indices of the arms' joints in the plant's velocities.
    """

    def __init__(
        self,
        torque: np.ndarray,
        frequency: float,
        seed: int,
        velocity_count: int,
        velocity_index: np.ndarray,
    ) -> None:
        super().__init__()
        rng = np.random.default_rng(seed)
        self._waves = [TremorWave(frequency, rng) for _ in range(2)]
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
