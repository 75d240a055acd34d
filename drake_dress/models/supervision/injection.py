"""Faults that a simulated lab injects, to test the reactions to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drake_dress.models.supervision.wrong_points import WRONG_POINTS

ARMS = ("left_arm", "right_arm")
# Faults of any source.
GENERAL_KINDS = (
    "stale",  # a source sends nothing
    "bus_lost",  # nothing is sent and nothing received
    "malformed",  # bytes that are not a message
    "nan",  # values that are not a number
    "time_back",  # time stamps in the past
    "clock_jump",  # time stamps in the future
    "set_back",  # a clock that is set back by less than a period
    "reordered",  # of each three messages, the second comes before the first
    "duplicated",  # every second message repeats the one before it
    "second_sender",  # every second message is from another sender, with a clock of its own
    "utime_zero",  # time stamps that are not filled in
)
# Faults of an arm.
ARM_KINDS = (
    "joint_limit",  # a joint reported where it cannot be
    "joint_leap",  # a reported joint position that jumps from one message to the next
    "mode_unknown",  # a robot_mode without information
    "push",  # something pushes an arm's gripper
    "arm_lost",  # an arm neither reports nor follows
)
KINDS = (*GENERAL_KINDS, *ARM_KINDS, *WRONG_POINTS)
# Errors of time stamps, s.
TIME_BACK, CLOCK_JUMP, SET_BACK, SECOND_CLOCK = -5.0, 3600.0, -0.008, -1000.0


@dataclass(frozen=True)
class InjectedFault:
    """A fault to inject, and when.

    Attributes:
        kind: one of `KINDS`.
        source: affected source: an arm, an estimate, a camera; the arm of a push or a lost arm.
        start: time since the first command, s. duration: s.
    """

    kind: str
    source: str
    start: float
    duration: float

    def at(self, time: float) -> bool:
        """Returns whether the fault is active at a time, s."""
        return self.start <= time < self.start + self.duration


def sources_of(kind: str) -> tuple[str, ...]:
    """Returns the sources that a kind of fault may affect; empty if it may affect any."""
    if kind in ARM_KINDS:
        return ARMS
    return (kind.split("_")[0],) if kind in WRONG_POINTS else ()


def kinds_at(faults: Sequence[InjectedFault], source: str, time: float) -> set[str]:
    """Returns the kinds of active faults of a source at a time, s; a lost bus affects all."""
    return {f.kind for f in faults if f.at(time) and (f.source == source or f.kind == "bus_lost")}
