"""Lets a request to open the grippers pass once somebody has confirmed it."""

from __future__ import annotations

from collections.abc import Callable

from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

# Returns whether the release is confirmed. The first call asks for it.
Confirm = Callable[[], bool]


def confirmed_at_once() -> bool:
    """Confirms every release."""
    return True


class ReleaseGate(LeafSystem):
    """Passes on a request to open the grippers once it is confirmed, for good.

    .. pydrake_system::

        name: ReleaseGate
        input_ports:
        - request
        output_ports:
        - release

    request: (1,) above 0.5 while the coat is laid and the grippers are to open. release: (1,) 1
    once it was confirmed during a request; it depends on state only. If the request ends before
    that, because a sleeve has slipped, nothing is passed on.

    Args:
        confirm: Returns at once whether the release is confirmed; called only during a request.
        period: Time between calls, s.
    """

    def __init__(self, confirm: Confirm, period: float) -> None:
        super().__init__()
        self._confirm = confirm
        self._state = self.DeclareDiscreteState([0.0])
        self.DeclareVectorInputPort("request", 1)
        self.DeclareVectorOutputPort(
            "release", 1, self._calc, {self.discrete_state_ticket(self._state)}
        )
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        passed = bool(context.get_discrete_state(self._state).value()[0] > 0.5)
        asked = bool(self.get_input_port(0).Eval(context)[0] > 0.5)
        if not passed and asked:
            passed = self._confirm()
        discrete.set_value(self._state, [float(passed)])

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._state).value())
