"""A perfect garment tracker."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy.sparse as sp
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_dress.models.effects.composition import seen_points, seen_rates
from drake_dress.models.effects.effect import Effect


class GarmentOracle(LeafSystem):
    """Maps the true garment to the nodes of the controller's own garment.

    .. pydrake_system::

        name: GarmentOracle
        input_ports:
        - garment_position
        - garment_velocity
        output_ports:
        - estimated_position
        - estimated_velocity

    Inputs (3n,) of the true garment, outputs (3m,) of the controller's, row-major, m and m/s. It
    takes the place of a garment tracker, so it may read the station's `cheat_` ports.

    Args:
        transfer: (m,n) barycentric weights; rows sum to 1.
        effects: Physical effects; those of cameras displace the observed garment.
    """

    def __init__(self, transfer: sp.csr_array, effects: Sequence[Effect] = ()) -> None:
        super().__init__()
        self._effects = tuple(effects)
        self._transfer = transfer
        m, n = transfer.shape
        for i, name in enumerate(("position", "velocity")):
            port = self.DeclareVectorInputPort(f"garment_{name}", 3 * n)
            self.DeclareVectorOutputPort(
                f"estimated_{name}", 3 * m, self._calc(i, n), {port.ticket()}
            )

    def _calc(self, port: int, n: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            value = self.get_input_port(port).Eval(context).reshape(n, 3)
            see = (seen_points, seen_rates)[port]
            output.SetFromVector(see(np.asarray(self._transfer @ value), self._effects).ravel())

        return calc
