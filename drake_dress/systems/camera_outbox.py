"""What a simulated lab sends of its cameras, taken elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any

import numpy as np
from drake import lcmt_image_array
from pydrake.common.value import Value
from pydrake.lcm import DrakeLcmInterface
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from drake_dress.models.supervision.injection import InjectedFault, kinds_at
from drake_dress.systems.spoiler import Spoiler

# Of looking whether a picture is there, s.
_LOOKING_PERIOD = 0.01
# Takes a camera's picture: its name, time, the plant's state, and the garment.
Take = Callable[[str, float, np.ndarray, np.ndarray], "Future[bytes]"]


class _Awaited:
    """The picture that is being taken, if one is; a copy of the context awaits the same one."""

    def __init__(self, pending: Future[bytes] | None = None) -> None:
        self.pending = pending

    def __deepcopy__(self, memo: dict[int, Any]) -> _Awaited:
        return _Awaited(self.pending)


class CameraOutbox(LeafSystem):
    """Has a camera's picture taken at a fixed rate, and publishes it when it is there.

    .. pydrake_system::

        name: CameraOutbox
        input_ports:
        - plant_state
        - garment_position
        - since
        output_ports: []

    plant_state: of the station's plant. garment_position: (3n,) m. since: (1,) time since the first
    command, s, to which faults are timed. A picture is late by what it takes; none is begun before
    the one before is done.

    Args:
        name: of the camera.
        channel: where to.
        take: its pictures.
        sizes: of the plant's state, and of the garment's.
        lcm: bus.
        period: s.
        faults: what goes wrong, and when.
    """

    def __init__(
        self,
        name: str,
        channel: str,
        take: Take,
        sizes: tuple[int, int],
        lcm: DrakeLcmInterface,
        period: float,
        faults: Sequence[InjectedFault] = (),
    ) -> None:
        super().__init__()
        self._name, self._channel, self._take, self._lcm = name, channel, take, lcm
        self._faults = tuple(faults)
        self._spoiler = Spoiler(lcmt_image_array)
        # events that publish may not change state: this is changed in place
        self._awaited = self.DeclareAbstractState(Value(_Awaited()))
        for port, size in zip(("plant_state", "garment_position"), sizes, strict=True):
            self.DeclareVectorInputPort(port, size)
        self.DeclareVectorInputPort("since", 1)
        self.DeclarePeriodicPublishEvent(period, 0.0, self._begin)
        self.DeclarePeriodicPublishEvent(_LOOKING_PERIOD, 0.0, self._look)

    def _awaited_in(self, context: Context) -> _Awaited:
        awaited: _Awaited = context.get_abstract_state(self._awaited).get_value()
        return awaited

    def _begin(self, context: Context) -> EventStatus:
        awaited = self._awaited_in(context)
        if awaited.pending is not None:
            return EventStatus.DidNothing()
        seen = [
            self.GetInputPort(port).Eval(context).copy()
            for port in ("plant_state", "garment_position")
        ]
        awaited.pending = self._take(self._name, context.get_time(), seen[0], seen[1])
        return EventStatus.Succeeded()

    def _look(self, context: Context) -> EventStatus:
        awaited = self._awaited_in(context)
        if awaited.pending is None or not awaited.pending.done():
            return EventStatus.DidNothing()
        picture, awaited.pending = awaited.pending.result(), None
        since = float(self.GetInputPort("since").Eval(context)[0])
        on = kinds_at(self._faults, f"camera_{self._name}", since)
        for encoded in self._spoiler(picture, on):
            self._lcm.Publish(self._channel, encoded)
        return EventStatus.Succeeded()
