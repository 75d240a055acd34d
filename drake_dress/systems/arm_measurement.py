"""Position, velocity and external force of the grippers, from the arms' measurements."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, ValueProducer

from drake_dress.models.arm.chain import SerialArm
from drake_dress.models.arm.external_load import gripper_motion
from drake_dress.models.sides import SIDES

_QUANTITIES = ("position", "velocity", "force")


class ArmMeasurement(LeafSystem):
    """Converts joint measurements of two arms into measurements of their grippers.

    .. pydrake_system::

        name: ArmMeasurement
        input_ports:
        - left_position
        - left_velocity
        - left_torque_external
        - left_valid (optional)
        - right_position
        - right_velocity
        - right_torque_external
        - right_valid (optional)
        output_ports:
        - left_gripper_position
        - left_gripper_velocity
        - left_gripper_force
        - right_gripper_position
        - right_gripper_velocity
        - right_gripper_force

    Inputs (7,) rad, rad/s, N·m; valid (1,), positive while an arm's measurements are valid. Outputs
    (3,) p_WG, m, v_WG, m/s, and the force of the garment on the gripper, N, in W; NaN while the
    arm's measurements are not valid.

    Args:
        arms: The left, then the right arm.
    """

    def __init__(self, arms: Sequence[SerialArm]) -> None:
        super().__init__()
        self._arms = list(arms)
        # compile now: the first cycle must not wait seconds for it
        gripper_motion(self._arms[0], *np.zeros((3, 7)))
        for side in SIDES:
            for name in ("position", "velocity", "torque_external"):
                self.DeclareVectorInputPort(f"{side}_{name}", 7)
            self.DeclareVectorInputPort(f"{side}_valid", 1)
        self._measured = [
            self.DeclareCacheEntry(
                f"{side}_gripper",
                ValueProducer(allocate=Value(np.zeros((3, 3))).Clone, calc=self._measure(i, side)),
            )
            for i, side in enumerate(SIDES)
        ]
        for i, side in enumerate(SIDES):
            for row, name in enumerate(_QUANTITIES):
                self.DeclareVectorOutputPort(f"{side}_gripper_{name}", 3, self._show(i, row))

    def _measure(self, i: int, side: str) -> Callable[[Context, AbstractValue], None]:
        def calc(context: Context, output: AbstractValue) -> None:
            valid = self.GetInputPort(f"{side}_valid")
            if valid.HasValue(context) and not valid.Eval(context)[0] > 0.5:
                output.set_value(np.full((3, 3), np.nan))
                return
            q, v, torque = (
                self.GetInputPort(f"{side}_{name}").Eval(context)
                for name in ("position", "velocity", "torque_external")
            )
            output.set_value(gripper_motion(self._arms[i], q, v, torque))

        return calc

    def _show(self, i: int, row: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._measured[i].Eval(context)[row])

        return calc
