"""Publishes camera images of a simulated lab, which are rendered elsewhere."""

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

# Period of polling for a finished image, s.
_LOOKING_PERIOD = 0.01
# Renders a camera's image, given its name, the time, the plant's state and the garment.
Take = Callable[[str, float, np.ndarray, np.ndarray], "Future[bytes]"]


class _Awaited:
    """The image being rendered, if any; a copy of the context waits for the same image."""

    def __init__(self, pending: Future[bytes] | None = None) -> None:
        self.pending = pending

    def __deepcopy__(self, memo: dict[int, Any]) -> _Awaited:
        return _Awaited(self.pending)


class CameraOutbox(LeafSystem):
    """Requests a camera image at a fixed rate and publishes it once it is rendered.

    .. pydrake_system::

        name: CameraOutbox
        input_ports:
        - plant_state
        - garment_position
        - since
        output_ports: []

    plant_state: state of the station's plant. garment_position: (3n,) m. since: (1,) time since the
    first command, s; fault times count from it. Rendering delays an image; the next one starts only
    after the last one is done.

    Args:
        name: Name of the camera.
        channel: LCM channel.
        take: Renders an image.
        sizes: Sizes of the plant's state and of the garment's positions.
        lcm: LCM bus.
        period: Period of the requests, s.
        faults: Faults to inject, with their times.
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
        # publish events may not change state, so this object is changed in place
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
