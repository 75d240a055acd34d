"""Measurement noise of tracked points."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem


class PointNoise(LeafSystem):
    """Adds noise to points; the noise depends on time and seed only.

    .. pydrake_system::

        name: PointNoise
        input_ports:
        - position
        output_ports:
        - noisy_position

    Both (3m,) row-major (m,3), m.

    Args:
        count: m.
        deviation: Standard deviation on each axis, m.
        seed: Seed of the noise.
    """

    def __init__(self, count: int, deviation: float, seed: int) -> None:
        super().__init__()
        self._deviation, self._seed = deviation, seed
        self.DeclareVectorInputPort("position", 3 * count)
        self.DeclareVectorOutputPort("noisy_position", 3 * count, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        position = self.get_input_port().Eval(context)
        # time in µs, which rounding may make negative
        moment = max(0, round(1e6 * context.get_time()))
        noise = np.random.default_rng([self._seed, moment]).normal(size=position.shape)
        output.SetFromVector(position + self._deviation * noise)
