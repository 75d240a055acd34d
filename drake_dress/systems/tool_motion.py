"""Motion of the grippers of arms in a plant."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_dress.models.sides import SIDES


class ToolMotion(LeafSystem):
    """Selects the motion of both tools from that of all bodies.

    .. pydrake_system::

        name: ToolMotion
        input_ports:
        - body_poses
        - body_spatial_velocities
        output_ports:
        - left_position
        - left_velocity
        - right_position
        - right_velocity

    Positions p_WT (3,), m, velocities v_WT (3,), m/s.

    Args:
        tools: Bodies of left and right tool.
    """

    def __init__(self, tools: Sequence[BodyIndex]) -> None:
        super().__init__()
        self._poses = self.DeclareAbstractInputPort("body_poses", Value[list[RigidTransform]]())
        self._velocities = self.DeclareAbstractInputPort(
            "body_spatial_velocities", Value[list[SpatialVelocity]]()
        )
        for side, tool in zip(SIDES, tools, strict=True):
            self.DeclareVectorOutputPort(
                f"{side}_position", 3, self._position(int(tool)), {self._poses.ticket()}
            )
            self.DeclareVectorOutputPort(
                f"{side}_velocity", 3, self._velocity(int(tool)), {self._velocities.ticket()}
            )

    def _position(self, tool: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._poses.Eval(context)[tool].translation())

        return calc

    def _velocity(self, tool: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(np.array(self._velocities.Eval(context)[tool].translational()))

        return calc
