"""What a simulated lab sends, and how it goes wrong when it is asked to."""

from __future__ import annotations

import struct
import time as clock
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from drake import lcmt_panda_status
from pydrake.common.value import AbstractValue
from pydrake.lcm import DrakeLcmInterface
from pydrake.systems.framework import Context, EventStatus, LeafSystem
from pydrake.systems.lcm import SerializerInterface

from drake_dress.models.arm.command_guard import Stop
from drake_dress.models.supervision.injection import (
    CLOCK_JUMP,
    TIME_BACK,
    InjectedFault,
    kinds_at,
)

# Changes a decoded message in place.
Spoil = Callable[[Any], None]


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
        spoils: what `nan` and `joint_limit` do to a message.
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
        spoils: dict[str, Spoil] | None = None,
    ) -> None:
        super().__init__()
        self._source, self._channel = source, channel
        self._serializer, self._type, self._lcm = serializer, lcm_type, lcm
        self._faults, self._spoils = tuple(faults), spoils or {}
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
        encoded = self._stamped(context, self._serializer.Serialize(value))
        sent = spoiled(encoded, on, self._type, self._spoils, context.get_time())
        if sent is None:
            return EventStatus.DidNothing()
        self._lcm.Publish(self._channel, sent)
        return EventStatus.Succeeded()


def spoiled(
    encoded: bytes, on: set[str], lcm_type: Any, spoils: dict[str, Spoil], time: float
) -> bytes | None:
    """Returns what is sent in place of a message while faults are on; None if nothing is.

    Args:
        encoded: the message.
        on: kinds of faults, of `models.supervision.injection`.
        lcm_type: Python class of the message.
        spoils: what kinds of faults do to a decoded message.
        time: s; bytes that are no message are drawn anew at each, and the same in each run.
    """
    if on & {"stale", "bus_lost", "arm_lost"}:
        return None
    if "malformed" in on:
        rng = np.random.default_rng(round(1e6 * time))
        garbage: bytes = rng.bytes(int(rng.integers(0, len(encoded) + 1)))
        return garbage
    if not on:
        return encoded
    message = lcm_type.decode(encoded)
    for kind in on & set(spoils):
        spoils[kind](message)
    shift = TIME_BACK * ("time_back" in on) + CLOCK_JUMP * ("clock_jump" in on)
    dated = message if hasattr(message, "utime") else message.header
    dated.utime += round(1e6 * shift)
    changed: bytes = message.encode()
    return changed


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
