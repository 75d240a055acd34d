"""Timing of the faults injected into a simulated lab."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.injection import InjectedFault, kinds_at

# Value of `since` before the first command, s.
NOT_BEGUN = -1.0


class FaultPlayer(LeafSystem):
    """Keeps the time since the first command, which fault times refer to, and plays arm faults.

    .. pydrake_system::

        name: FaultPlayer
        input_ports:
        - left_valid
        - right_valid
        output_ports:
        - since
        - left_fresh
        - right_fresh
        - push
        - idle

    *_valid: (1,) 1 while an arm's commands arrive and are valid. since: (1,) time since both arms
    first had valid commands, s, or -1. *_fresh: (1,) 1 while an arm receives its commands. push:
    (6,) N, on the grippers, outward and backward. idle: (1,) time since the last valid command, s.

    Args:
        faults: Faults to inject.
        push: Size of a push, N.
        period: Period of the discrete update, s.
    """

    def __init__(self, faults: Sequence[InjectedFault], push: float, period: float) -> None:
        super().__init__()
        self._faults, self._push = tuple(faults), push
        # time of the first commands, and time of the last valid command
        self._begun = self.DeclareDiscreteState([np.inf, 0.0])
        for side in SIDES:
            self.DeclareVectorInputPort(f"{side}_valid", 1)
        self.DeclareVectorOutputPort("since", 1, self._calc_since)
        for side in SIDES:
            self.DeclareVectorOutputPort(f"{side}_fresh", 1, self._fresh(side))
        self.DeclareVectorOutputPort("push", 6, self._calc_push)
        self.DeclareVectorOutputPort("idle", 1, self._calc_idle)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _valid(self, context: Context) -> list[bool]:
        return [bool(self.GetInputPort(f"{s}_valid").Eval(context)[0] > 0.5) for s in SIDES]

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        begun, idle = context.get_discrete_state(self._begun).value()
        valid, now = self._valid(context), context.get_time()
        if all(valid):
            begun = min(begun, now)
        discrete.set_value(self._begun, [begun, now if any(valid) else idle])

    def _since(self, context: Context) -> float:
        begun = float(context.get_discrete_state(self._begun).value()[0])
        return context.get_time() - begun if np.isfinite(begun) else NOT_BEGUN

    def _calc_since(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([self._since(context)])

    def _calc_idle(self, context: Context, output: BasicVector) -> None:
        last = float(context.get_discrete_state(self._begun).value()[1])
        output.SetFromVector([context.get_time() - last])

    def _fresh(self, side: str) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            valid = self.GetInputPort(f"{side}_valid").Eval(context)[0] > 0.5
            on = kinds_at(self._faults, f"{side}_arm", self._since(context))
            output.SetFromVector([float(valid and not on & {"bus_lost", "arm_lost"})])

        return calc

    def _calc_push(self, context: Context, output: BasicVector) -> None:
        push = np.zeros((2, 3))
        for i, side in enumerate(SIDES):
            if "push" in kinds_at(self._faults, f"{side}_arm", self._since(context)):
                push[i] = self._push * np.array([-0.8, 0.6 if side == "left" else -0.6, 0.0])
        output.SetFromVector(push.ravel())
