"""Tremor of the arms."""

from __future__ import annotations

import numpy as np

from drake_dress.models.human.tremor import TremorWave
from drake_dress.systems.arm_torque import ArmTorque


class HandTremor(ArmTorque):
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
        rng = np.random.default_rng(seed)
        waves = [TremorWave(frequency, rng) for _ in range(2)]
        super().__init__(torque, waves, velocity_count, velocity_index)
