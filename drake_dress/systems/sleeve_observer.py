"""The sleeves of an estimated garment."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_dress.models.dressing.sleeve import loop_orientation, sleeve_state
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES


class SleeveObserver(LeafSystem):
    """Outputs centre and direction of both armholes.

    .. pydrake_system::

        name: SleeveObserver
        input_ports:
        - garment_position
        output_ports:
        - sleeve_state

    garment_position: (3m,) row-major (m,3), m. sleeve_state: (12,) row-major (2,6) centre, m, and
    unit direction from cuff to armhole, of left and right.

    Args:
        mesh: The garment.
    """

    def __init__(self, mesh: GarmentMesh) -> None:
        super().__init__()
        self._loops = [np.asarray(mesh.loops[f"{side}_armhole"]) for side in SIDES]
        self._signs = [loop_orientation(mesh, side) for side in SIDES]
        self.DeclareVectorInputPort("garment_position", 3 * len(mesh.rest_position))
        self.DeclareVectorOutputPort("sleeve_state", 12, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        x = self.get_input_port().Eval(context).reshape(-1, 3)
        states = [
            sleeve_state(x, loop, sign) for loop, sign in zip(self._loops, self._signs, strict=True)
        ]
        output.SetFromVector(np.concatenate([[*s.p_c, *s.v_c] for s in states]))
