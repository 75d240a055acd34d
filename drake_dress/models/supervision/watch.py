"""Watches one source of messages: is what it says fresh, sound, and of this time?

A source sends messages with a stamp of its own clock. A watch keeps two clocks apart: it never
compares a stamp to its own time, only how far both went from one message to the next. So clocks
need not be set to each other, and the lab's may run slower.
"""

from __future__ import annotations

from dataclasses import dataclass

from drake_dress.models.supervision.fault import FATAL, TELLING, Fault, Finding
from drake_dress.models.supervision.order import order

__all__ = ["FATAL", "TELLING", "Arrival", "Fault", "WatchSettings", "WatchState", "watch"]


@dataclass(frozen=True)
class WatchSettings:
    """What is asked of a source.

    Attributes:
        max_age: since the last sound message, s.
        jump: by which a stamp may go on more than time did, s.
        late: by which a stamp may be before the newest one, s; such a message is dropped.
    """

    max_age: float
    jump: float = 0.5
    late: float = 0.05


@dataclass(frozen=True)
class Arrival:
    """What has come from a source until now.

    Attributes:
        count: of all messages but those that were dropped, sound or not.
        stamp: of the last message that was of the right kind, s of its source's clock.
        fault: of the last message: none where it was sound.
        reason: of that fault, as of `Finding`.
        dropped: count of messages that were repeated, or late.
    """

    count: int = 0
    stamp: float = 0.0
    fault: Fault = Fault.NONE
    reason: str = ""
    dropped: int = 0


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
        reason: of the fault; of what is fatal, the first.
        total: count of all messages, dropped ones too, when the last sound one had come.
    """

    count: int = 0
    stamp: float | None = None
    heard: float = 0.0
    fault: Fault = Fault.STALE
    came: bool = False
    reason: str = ""
    total: int = 0


def watch(state: WatchState, arrival: Arrival, now: float, settings: WatchSettings) -> WatchState:
    """Returns what a watch knows at `now`, s.

    What is fatal stays; all else goes when a sound message has come.
    """
    fault, stamp, heard, came = state.fault, state.stamp, state.heard, state.came
    reason, total, seen = state.reason, state.total, arrival.count + arrival.dropped
    found = _found(state, arrival, now, settings) if arrival.count != state.count else None
    if found is not None:
        if not fault & FATAL:
            reason = found.reason
        fault = (fault & FATAL) | found.fault
        if found.usable:
            came = stamp is not None
            stamp, heard, total = arrival.stamp, now, seen
    if stamp is None or now - heard > settings.max_age:
        silent = Finding(Fault.STALE, reason)
        if not fault & ~(Fault.STALE | Fault.UNSTAMPED):
            silent = _silent(stamp, seen > total)
        fault, reason = fault | silent.fault, reason or silent.reason
    else:
        fault &= ~Fault.STALE
    return WatchState(arrival.count, stamp, heard, fault, came, reason if fault else "", total)


def _found(
    state: WatchState, arrival: Arrival, now: float, settings: WatchSettings
) -> Finding | None:
    """Returns what is wrong with what came; None if it is to be dropped."""
    found = Finding(arrival.fault, arrival.reason)
    if found.fault & (Fault.MALFORMED | Fault.WRONG_SIZE) or state.stamp is None:
        return found
    in_order = order(arrival.stamp, state.stamp, settings.late)
    if in_order is None:
        return None
    if in_order.fault & ~found.fault:
        return Finding(found.fault | in_order.fault, in_order.reason)
    gone, passed = arrival.stamp - state.stamp, now - state.heard
    if state.came and gone > passed + settings.jump:
        reason = (
            f"utime went on by {gone:.3f} s in {passed:.3f} s, expected {settings.jump:g} s more "
            "at most: a clock that was set, or a second sender on the channel"
        )
        return Finding(found.fault | Fault.CLOCK_JUMP, reason)
    return found


def _silent(stamp: float | None, messages_came: bool) -> Finding:
    """Returns what is wrong with a source of which nothing new is heard.

    Args:
        stamp: of its last sound message, s; None if there was none.
        messages_came: whether messages came since, none of them new.
    """
    if stamp is None or not messages_came:
        return Finding(Fault.STALE)
    if stamp == 0.0:
        return Finding(Fault.UNSTAMPED, "utime is never filled in: it is 0 in each message")
    return Finding(Fault.STALE, f"messages come, and utime stands still at {stamp:.3f} s")
