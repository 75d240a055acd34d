"""Where the person's arms will be."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem


class HumanPredictor(LeafSystem):
    """Predicts that the arms stay where they are seen: a dummy has no will.

    .. pydrake_system::

        name: HumanPredictor
        input_ports:
        - joint_position
        output_ports:
        - predicted_joint_position

    joint_position: (18,), m. predicted_joint_position: ((N+1)·18,) row-major (N+1,6,3), row 0 is
    now, then every step of the controller's prediction.

    Args:
        horizon: N.
    """

    def __init__(self, horizon: int) -> None:
        super().__init__()
        self._horizon = horizon
        self.DeclareVectorInputPort("joint_position", 18)
        self.DeclareVectorOutputPort("predicted_joint_position", 18 * (horizon + 1), self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.tile(self.get_input_port(0).Eval(context), self._horizon + 1))
