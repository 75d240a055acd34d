"""Faults that a simulated lab plays, so that reactions to them can be tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drake_dress.models.supervision.wrong_points import WRONG_POINTS

ARMS = ("left_arm", "right_arm")
# Of any source.
GENERAL_KINDS = (
    "stale",  # a source sends nothing
    "bus_lost",  # nothing is sent and nothing heard
    "malformed",  # bytes that are no message
    "nan",  # numbers that are none
    "time_back",  # stamps of the past
    "clock_jump",  # stamps of the future
    "set_back",  # a clock that is set back by less than a period
    "reordered",  # of each three messages, the second comes before the first
    "duplicated",  # every second message is the one before it again
    "second_sender",  # every second message is of another sender, with a clock of its own
    "utime_zero",  # stamps that are not filled in
)
# Of an arm.
ARM_KINDS = (
    "joint_limit",  # a joint reported where it cannot be
    "joint_leap",  # a joint reported elsewhere from one message to the next
    "mode_unknown",  # a robot_mode that says nothing
    "push",  # something pushes an arm's gripper
    "arm_lost",  # an arm neither reports nor follows
)
KINDS = (*GENERAL_KINDS, *ARM_KINDS, *WRONG_POINTS)
# Of the time that stamps are off by, s.
TIME_BACK, CLOCK_JUMP, SET_BACK, SECOND_CLOCK = -5.0, 3600.0, -0.008, -1000.0


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


def sources_of(kind: str) -> tuple[str, ...]:
    """Returns the sources that a kind of fault may be of; none where any may have it."""
    if kind in ARM_KINDS:
        return ARMS
    return (kind.split("_")[0],) if kind in WRONG_POINTS else ()


def kinds_at(faults: Sequence[InjectedFault], source: str, time: float) -> set[str]:
    """Returns what goes wrong with a source at a time; a lost bus is wrong with all."""
    return {f.kind for f in faults if f.at(time) and (f.source == source or f.kind == "bus_lost")}
