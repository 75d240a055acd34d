"""Lowers a person's arms once both sleeves are on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.lowering import least_lift, longer, lowered, next_share


@dataclass(frozen=True)
class Around:
    """A chair that arms have to go around on their way down.

    Attributes:
        room: returns the distances (2,), m, of both arms with angles (2,4), rad, from it.
        angles: (8,) indices of the arms' angles in the person's state.
        state_size: size of the person's state.
    """

    room: Callable[[FloatArray], FloatArray]
    angles: IndexArray
    state_size: int


class ArmLowering(LeafSystem):
    """Passes on the set-point of the arms until the person is told to lower them.

    .. pydrake_system::

        name: ArmLowering
        input_ports:
        - set_point
        - set_point_rate (optional)
        - told (optional)
        - person_state (optional)
        output_ports:
        - lowered_set_point
        - lowered_set_point_rate

    set_point, set_point_rate: (8,) abduction, extension, rotation, elbow of the left, then the
    right arm, rad, rad/s. told: (1,) above 0.5 while the person is told to lower the arms;
    never, if not connected. person_state: (2d,) positions and velocities of the person's joints,
    rad, rad/s; only with `around`. Outputs: as the inputs, lowered; see
    `models/human/lowering.py`.

    Args:
        pose: (2,4) angles of both arms in the end, rad.
        duration: Time that it takes, s; longer if the arms have to go around something.
        period: Period of the discrete update, s.
        around: The chair that the arms have to go around, if there is one.
    """

    def __init__(
        self, pose: np.ndarray, duration: float, period: float, around: Around | None = None
    ) -> None:
        super().__init__()
        self._pose, self._duration, self._period = np.asarray(pose), duration, period
        self._around = around
        # share of the way down, and its rate, 1/s
        self._state = self.DeclareDiscreteState([0.0, 0.0])
        # lift of left and right arm on the way, rad
        self._lift = self.DeclareDiscreteState([0.0, 0.0])
        # how many times as long the way is with it
        self._longer = self.DeclareDiscreteState([1.0])
        self.DeclareVectorInputPort("set_point", 8)
        self._rate = self.DeclareVectorInputPort("set_point_rate", 8)
        self._told = self.DeclareVectorInputPort("told", 1)
        if around is not None:
            self._person = self.DeclareVectorInputPort("person_state", around.state_size)
        self.DeclareVectorOutputPort("lowered_set_point", 8, self._calc(0))
        self.DeclareVectorOutputPort("lowered_set_point_rate", 8, self._calc(1))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        before = float(context.get_discrete_state(self._state).value()[0])
        is_told = self._told.HasValue(context) and bool(self._told.Eval(context)[0] > 0.5)
        longer_by = float(context.get_discrete_state(self._longer).value()[0])
        if self._around is not None and before == 0.0 and is_told:
            state: FloatArray = self._person.Eval(context)
            start = state[self._around.angles].reshape(2, 4)
            lift = least_lift(self._around.room, start, self._pose)
            longer_by = longer(start, self._pose, lift)
            discrete.set_value(self._lift, lift)
            discrete.set_value(self._longer, [longer_by])
        share = next_share(before, is_told, longer_by * self._duration, self._period)
        discrete.set_value(self._state, [share, (share - before) / self._period])

    def _calc(self, which: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            set_point: FloatArray = self.get_input_port(0).Eval(context).reshape(2, 4)
            rate = np.zeros((2, 4))
            if self._rate.HasValue(context):
                rate = self._rate.Eval(context).reshape(2, 4)
            share, share_rate = context.get_discrete_state(self._state).value()
            lift = None if self._around is None else context.get_discrete_state(self._lift).value()
            found = lowered(set_point, rate, self._pose, float(share), float(share_rate), lift)
            output.SetFromVector(found[which].ravel())

        return calc
