"""Forces of the garment on the grippers of arms in a plant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, LeafSystem

from drake_dress.models.sides import SIDES


class ToolLoad(LeafSystem):
    """Converts forces on both tools into applied spatial forces of a plant.

    .. pydrake_system::

        name: ToolLoad
        input_ports:
        - left_force
        - right_force
        - push (optional)
        output_ports:
        - spatial_forces

    Forces (3,) on the tools' origins, N, in W; push (6,) additional forces on left and right, N.
    spatial_forces: list of ExternallyAppliedSpatialForce.

    Args:
        tools: Bodies of left and right tool.
    """

    def __init__(self, tools: Sequence[BodyIndex]) -> None:
        super().__init__()
        self._tools = list(tools)
        for side in SIDES:
            self.DeclareVectorInputPort(f"{side}_force", 3)
        self.DeclareVectorInputPort("push", 6)
        self.DeclareAbstractOutputPort(
            "spatial_forces", lambda: Value[list[ExternallyAppliedSpatialForce]]([]), self._calc
        )

    def _calc(self, context: Context, output: Value) -> None:
        forces = []
        port = self.GetInputPort("push")
        push = port.Eval(context) if port.HasValue(context) else np.zeros(6)
        for i, tool in enumerate(self._tools):
            applied = ExternallyAppliedSpatialForce()
            applied.body_index = tool
            applied.p_BoBq_B = np.zeros(3)
            force = self.get_input_port(i).Eval(context) + push[3 * i : 3 * i + 3]
            applied.F_Bq_W = SpatialForce(tau=np.zeros(3), f=force)
            forces.append(applied)
        output.set_value(forces)
