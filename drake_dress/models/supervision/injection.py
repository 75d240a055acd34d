"""Faults that a simulated lab plays, so that reactions to them can be tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

KINDS = (
    "stale",  # a source sends nothing
    "bus_lost",  # nothing is sent and nothing heard
    "malformed",  # bytes that are no message
    "nan",  # numbers that are none
    "time_back",  # stamps of the past
    "clock_jump",  # stamps of the future
    "joint_limit",  # a joint reported where it cannot be
    "push",  # something pushes an arm's gripper
    "arm_lost",  # an arm neither reports nor follows
)
# Of the time that stamps are off by, s.
TIME_BACK, CLOCK_JUMP = -5.0, 3600.0


@dataclass(frozen=True)
class InjectedFault:
    """What goes wrong, and when.

    Attributes:
        kind: of `KINDS`.
        source: which source: an arm, an estimate, a camera; of a push and a lost arm the arm.
        start: since the first command, s. duration: s.
    """

    kind: str
    source: str
    start: float
    duration: float

    def at(self, time: float) -> bool:
        """Returns whether it is on."""
        return self.start <= time < self.start + self.duration


def kinds_at(faults: Sequence[InjectedFault], source: str, time: float) -> set[str]:
    """Returns what goes wrong with a source at a time; a lost bus is wrong with all."""
    return {f.kind for f in faults if f.at(time) and (f.source == source or f.kind == "bus_lost")}
