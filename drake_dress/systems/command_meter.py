"""Times at which commands were sent, and the age of the statuses they respond to."""

from __future__ import annotations

import os
import time as clock
from pathlib import Path

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from drake_dress.models.sides import SIDES
from drake_dress.systems.lcm_inbox import Received

# Greatest plausible age of a status, s; a larger age means a clock of another machine.
_LONGEST = 10.0
_KEPT = 60_000


class CommandMeter(LeafSystem):
    """Records the time of each command and the age of the newest status, at the command rate.

    .. pydrake_system::

        name: CommandMeter
        input_ports:
        - left
        - right
        output_ports: []

    Inputs: `Received` of lcmt_panda_status. The age is the time since the status's robot_utime,
    which a lab on this machine sets when it sends. It covers transport, waiting and processing.

    Args:
        period, offset: Period and offset of the commands, s.

    Only the commands of the last few minutes are kept, however long a run takes. They are kept
    outside the context: they describe this process and its clock, not the simulation, and nothing
    in a diagram reads them.
    """

    def __init__(self, period: float, offset: float) -> None:
        super().__init__()
        self._kept = np.empty((_KEPT, 3))
        self._count = 0
        self.first: float | None = None
        for side in SIDES:
            self.DeclareAbstractInputPort(side, Value(Received()))
        self.DeclarePeriodicPublishEvent(period, offset, self._publish)

    def _publish(self, context: Context) -> EventStatus:
        now = clock.monotonic()
        if self.first is None:
            self.first = now
        row = self._kept[self._count % _KEPT]
        row[0] = now
        for i in range(2):
            message = self.get_input_port(i).Eval(context).message
            age = np.nan if message is None else now - 1e-6 * message.robot_utime
            row[1 + i] = age if 0.0 <= age <= _LONGEST else np.nan
        self._count += 1
        return EventStatus.Succeeded()

    @property
    def commands(self) -> tuple[np.ndarray, np.ndarray]:
        """Times (K,), s of the monotonic clock, and ages (K,2), s, NaN by another clock's stamp."""
        kept = self._kept[: min(self._count, _KEPT)]
        kept = kept[np.argsort(kept[:, 0], kind="stable")]
        return kept[:, 0], kept[:, 1:]


def process_age(at: float) -> float:
    """Returns the age of this process at a time of the monotonic clock, s."""
    fields = Path("/proc/self/stat").read_text().rsplit(")", 1)[1].split()
    began = float(fields[19]) / os.sysconf("SC_CLK_TCK")
    since_boot = clock.clock_gettime(clock.CLOCK_BOOTTIME)
    return since_boot - began - (clock.monotonic() - at)
