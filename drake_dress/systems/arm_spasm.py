"""Spasms of the arms."""

from __future__ import annotations

import numpy as np

from drake_dress.models.human.spasm import SpasmParameters, Spasms, spasm_torque
from drake_dress.models.sides import SIDES
from drake_dress.systems.arm_torque import ArmTorque


class ArmSpasm(ArmTorque):
    """Applies the torques of spasms to the arms; see `models/human/spasm.py`.

    .. pydrake_system::

        name: ArmSpasm
        output_ports:
        - generalized_force

    generalized_force: (nv,) for the plant's applied generalized force, N·m; it depends on
    time only.

    Args:
        parameters: Arms that have spasms, their strength and times.
        seed: Seed of times and strengths; equal seeds give equal spasms.
        velocity_count: nv of the plant.
        velocity_index: (8,) indices of the arms' joints in the plant's velocities.
    """

    def __init__(
        self,
        parameters: SpasmParameters,
        seed: int,
        velocity_count: int,
        velocity_index: np.ndarray,
    ) -> None:
        # a stream of its own, so that a tremor with the same seed is independent
        rng = np.random.default_rng([seed, 1])
        super().__init__(
            np.concatenate([spasm_torque(parameters, side) for side in SIDES]),
            [Spasms(parameters, rng) for _ in SIDES],
            velocity_count,
            velocity_index,
        )
