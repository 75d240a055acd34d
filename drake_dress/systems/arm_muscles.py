"""Muscles that hold the arms at a set-point."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_dress.models.human.arm import Arms
from drake_dress.models.human.muscles import muscle_torque


class ArmMuscles(LeafSystem):
    """Shifts the plant's joint springs to a set-point and compensates gravity there.

    .. pydrake_system::

        name: ArmMuscles
        input_ports:
        - set_point
        - set_point_rate
        output_ports:
        - generalized_force

    set_point: (8,) abduction, extension, rotation, elbow of the left, then the right arm, rad.
    set_point_rate: (8,), rad/s; zero if not connected. generalized_force: (nv,) for the plant's
    applied generalized force, N·m.

    Args:
        arms: Kinematics, masses and joints.
        velocity_count: nv of the plant.
        velocity_index: (8,) indices of the arms' joints in the plant's velocities.
    """

    def __init__(self, arms: Arms, velocity_count: int, velocity_index: np.ndarray) -> None:
        super().__init__()
        self._arms = arms
        self._count, self._index = velocity_count, np.asarray(velocity_index)
        self.DeclareVectorInputPort("set_point", 8)
        self._rate = self.DeclareVectorInputPort("set_point_rate", 8)
        self.DeclareVectorOutputPort("generalized_force", velocity_count, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        a = self._arms
        set_point = self.get_input_port(0).Eval(context).reshape(2, 4)
        rate = np.zeros((2, 4))
        if self._rate.HasValue(context):
            rate = self._rate.Eval(context).reshape(2, 4)
        force = np.zeros(self._count)
        for i, arm in enumerate(a.arms):
            force[self._index[4 * i : 4 * i + 4]] = muscle_torque(
                arm, set_point[i], rate[i], a.rest[i], a.stiffness[i], a.damping[i]
            )
        output.SetFromVector(force)
