"""Publishes messages of a simulated lab, with optional fault injection."""

from __future__ import annotations

import struct
import time as clock
from collections.abc import Mapping, Sequence
from typing import Any

from drake import lcmt_panda_status
from pydrake.common.value import AbstractValue
from pydrake.lcm import DrakeLcmInterface
from pydrake.systems.framework import Context, EventStatus, LeafSystem
from pydrake.systems.lcm import SerializerInterface

from drake_dress.models.arm.command_guard import Stop
from drake_dress.models.supervision.injection import InjectedFault, kinds_at
from drake_dress.systems.spoiler import Spoil, Spoiler


class Outbox(LeafSystem):
    """Publishes a message at a fixed rate, like LcmPublisherSystem, but with injected faults.

    .. pydrake_system::

        name: Outbox
        input_ports:
        - message
        - since (optional)
        output_ports: []

    since: (1,) time since the first command, s; fault times count from it.

    Args:
        source: Name of the message's source in faults.
        channel: LCM channel.
        serializer: Serializer of the message.
        lcm_type: Python class of the message.
        lcm: LCM bus.
        period: Period, s. offset: Time of the first message, s.
        faults: Faults to inject, with their times.
        spoils: By kind of fault, how it changes a message; adds to those built into `Spoiler`.
    """

    def __init__(
        self,
        source: str,
        channel: str,
        serializer: SerializerInterface,
        lcm_type: Any,
        lcm: DrakeLcmInterface,
        period: float,
        offset: float = 0.0,
        faults: Sequence[InjectedFault] = (),
        spoils: Mapping[str, Spoil] | None = None,
    ) -> None:
        super().__init__()
        self._source, self._channel = source, channel
        self._serializer, self._lcm, self._faults = serializer, lcm, tuple(faults)
        self._spoiler = Spoiler(lcm_type, spoils)
        self.DeclareAbstractInputPort("message", serializer.CreateDefaultValue())
        self.DeclareVectorInputPort("since", 1)
        self.DeclarePeriodicPublishEvent(period, offset, self._publish)

    def _stamped(self, context: Context, encoded: bytes) -> bytes:
        """Returns the bytes to send for a message before faults are applied."""
        return encoded

    def _publish(self, context: Context) -> EventStatus:
        since = self.GetInputPort("since")
        on: set[str] = set()
        if self._faults and since.HasValue(context):
            on = kinds_at(self._faults, self._source, float(since.Eval(context)[0]))
        value: AbstractValue = self.GetInputPort("message").EvalAbstract(context)
        sent = self._spoiler(self._stamped(context, self._serializer.Serialize(value)), on)
        for encoded in sent:
            self._lcm.Publish(self._channel, encoded)
        return EventStatus.Succeeded() if sent else EventStatus.DidNothing()


class StatusOutbox(Outbox):
    """Publishes an arm's status, including fields that Drake's PandaStatusSender omits.

    .. pydrake_system::

        name: StatusOutbox
        input_ports:
        - message
        - since (optional)
        - stop
        output_ports: []

    stop: (1,) a `models.arm.command_guard.Stop`: why the arm's driver does not follow commands. It
    sets the message's robot_mode: moving, idle or reflex. robot_utime is this machine's monotonic
    clock, µs; it is used to measure latency.
    """

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.DeclareVectorInputPort("stop", 1)

    def _stamped(self, context: Context, encoded: bytes) -> bytes:
        stop = Stop(int(self.GetInputPort("stop").Eval(context)[0]))
        now = clock.clock_gettime_ns(clock.CLOCK_MONOTONIC) // 1000
        return with_tail(encoded, _MODES.get(stop, lcmt_panda_status.kReflex), now)


_MODES = {Stop.NONE: lcmt_panda_status.kMove, Stop.ENDED: lcmt_panda_status.kIdle}
# The last fields of a lcmt_panda_status: robot_mode, robot_utime, control_mode.
_TAIL = struct.Struct(">bqb")


def with_tail(encoded: bytes, robot_mode: int, robot_utime: int) -> bytes:
    """Returns the bytes of a lcmt_panda_status with its robot mode and time replaced."""
    *_, control_mode = _TAIL.unpack(encoded[-_TAIL.size :])
    return encoded[: -_TAIL.size] + _TAIL.pack(robot_mode, robot_utime, control_mode)
