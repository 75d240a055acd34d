"""Watches one source of messages: is what it says fresh, sound, and of this time?

A source sends messages with a stamp of its own clock. A watch keeps two clocks apart: it never
compares a stamp to its own time, only how far both went from one message to the next. So clocks
need not be set to each other, and the lab's may run slower.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag


class Fault(IntFlag):
    """What is wrong with a source."""

    NONE = 0
    STALE = 1  # nothing new for too long
    MALFORMED = 2  # bytes that are no message of this kind
    NOT_FINITE = 4  # a message with a number that is none
    WRONG_SIZE = 8  # a message of other joints, nodes, or cameras
    TIME_BACK = 16  # a stamp before one that was heard
    CLOCK_JUMP = 32  # a stamp that went on by much more than time did
    JOINT_LIMIT = 64  # a joint outside what its maker allows
    SPEED_LIMIT = 128  # a joint faster than that
    STOPPED = 256  # the source itself reports that it does not follow
    IDLE = 512  # it reports that it follows no command yet, or no longer


# After these nothing that follows can be put in order: the run ends.
FATAL = Fault.TIME_BACK | Fault.CLOCK_JUMP | Fault.JOINT_LIMIT | Fault.SPEED_LIMIT


# With these a message still tells where its source is.
TELLING = Fault.STOPPED | Fault.IDLE


@dataclass(frozen=True)
class WatchSettings:
    """What is asked of a source.

    Attributes:
        max_age: since the last sound message, s.
        jump: by which a stamp may go on more than time did, s.
    """

    max_age: float
    jump: float = 0.5


@dataclass(frozen=True)
class Arrival:
    """What has come from a source until now.

    Attributes:
        count: of all messages, sound or not.
        stamp: of the last message that was of the right kind, s of its source's clock.
        fault: of the last message: none where it was sound.
    """

    count: int = 0
    stamp: float = 0.0
    fault: Fault = Fault.NONE


@dataclass(frozen=True)
class WatchState:
    """What a watch remembers.

    Attributes:
        count: of messages looked at.
        stamp: of the last sound one, s; None before the first.
        heard: when it came, s of the watch's own clock, or before: the first one that is looked at
            may have waited.
        fault: what is wrong now.
        came: whether a message came since the first look, so that `heard` is when it did.
    """

    count: int = 0
    stamp: float | None = None
    heard: float = 0.0
    fault: Fault = Fault.STALE
    came: bool = False


def watch(state: WatchState, arrival: Arrival, now: float, settings: WatchSettings) -> WatchState:
    """Returns what a watch knows at `now`, s.

    What is fatal stays; all else goes when a sound message has come.
    """
    fault, stamp, heard, came = state.fault, state.stamp, state.heard, state.came
    if arrival.count != state.count:
        found = arrival.fault
        if not found & (Fault.MALFORMED | Fault.WRONG_SIZE) and stamp is not None:
            gone = arrival.stamp - stamp
            if gone < 0.0:
                found |= Fault.TIME_BACK
            elif came and gone > now - heard + settings.jump:
                found |= Fault.CLOCK_JUMP
        fault = (fault & FATAL) | found
        # the same stamp again is the same message again
        if not found & ~TELLING and (stamp is None or arrival.stamp > stamp):
            came = stamp is not None
            stamp, heard = arrival.stamp, now
    if stamp is None or now - heard > settings.max_age:
        fault |= Fault.STALE
    else:
        fault &= ~Fault.STALE
    return WatchState(arrival.count, stamp, heard, fault, came)
