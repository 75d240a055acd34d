"""What a simulated lab sends, and how it goes wrong when it is asked to."""

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
    """Publishes a message at a fixed rate, as LcmPublisherSystem does, unless a fault is on.

    .. pydrake_system::

        name: Outbox
        input_ports:
        - message
        - since (optional)
        output_ports: []

    since: (1,) time since the first command, s, to which faults are timed.

    Args:
        source: the message's name among faults.
        channel: where to.
        serializer: of the message.
        lcm_type: Python class of it.
        lcm: bus.
        period: s. offset: of the first message, s.
        faults: what goes wrong, and when.
        spoils: what kinds of faults do to a message, beside those that `Spoiler` knows.
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
        """Returns what is sent in place of a message that nothing is wrong with."""
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
    """Publishes an arm's status, with what Drake's PandaStatusSender leaves out.

    .. pydrake_system::

        name: StatusOutbox
        input_ports:
        - message
        - since (optional)
        - stop
        output_ports: []

    stop: (1,) why the arm's driver does not follow, of `models.arm.command_guard.Stop`. It becomes
    the message's robot_mode: moving, idle, or reflex. robot_utime is this machine's monotonic
    clock, µs, by which latency is measured.
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
    """Returns the bytes of a lcmt_panda_status with another mode and time of the robot."""
    *_, control_mode = _TAIL.unpack(encoded[-_TAIL.size :])
    return encoded[: -_TAIL.size] + _TAIL.pack(robot_mode, robot_utime, control_mode)
