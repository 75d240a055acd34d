"""Lowers a person's arms once both sleeves are on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.lowering import lowered, next_share


class ArmLowering(LeafSystem):
    """Passes on the set-point of the arms until the person is told to lower them.

    .. pydrake_system::

        name: ArmLowering
        input_ports:
        - set_point
        - set_point_rate (optional)
        - told (optional)
        output_ports:
        - lowered_set_point
        - lowered_set_point_rate

    set_point, set_point_rate: (8,) abduction, extension, rotation, elbow of the left, then the
    right arm, rad, rad/s. told: (1,) above 0.5 while the person is told that both sleeves are on;
    never, if not connected. Outputs: as the inputs, lowered; see `models/human/lowering.py`.

    Args:
        pose: (2,4) angles of both arms in the end, rad.
        duration: Time that it takes, s.
        period: Period of the discrete update, s.
    """

    def __init__(self, pose: np.ndarray, duration: float, period: float) -> None:
        super().__init__()
        self._pose, self._duration, self._period = np.asarray(pose), duration, period
        # share of the way down, and its rate, 1/s
        self._state = self.DeclareDiscreteState([0.0, 0.0])
        self.DeclareVectorInputPort("set_point", 8)
        self._rate = self.DeclareVectorInputPort("set_point_rate", 8)
        self._told = self.DeclareVectorInputPort("told", 1)
        self.DeclareVectorOutputPort("lowered_set_point", 8, self._calc(0))
        self.DeclareVectorOutputPort("lowered_set_point_rate", 8, self._calc(1))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        before = float(context.get_discrete_state(self._state).value()[0])
        is_told = self._told.HasValue(context) and bool(self._told.Eval(context)[0] > 0.5)
        share = next_share(before, is_told, self._duration, self._period)
        discrete.set_value(self._state, [share, (share - before) / self._period])

    def _calc(self, which: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            set_point: FloatArray = self.get_input_port(0).Eval(context).reshape(2, 4)
            rate = np.zeros((2, 4))
            if self._rate.HasValue(context):
                rate = self._rate.Eval(context).reshape(2, 4)
            share, share_rate = context.get_discrete_state(self._state).value()
            found = lowered(set_point, rate, self._pose, float(share), float(share_rate))
            output.SetFromVector(found[which].ravel())

        return calc
