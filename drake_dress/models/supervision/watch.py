"""Watches one source of messages: whether they are fresh, sound, and in order of time.

A source stamps its messages by its own clock. A watch never compares a time stamp with its own
time, only the advance of both clocks from one message to the next. The clocks therefore need not be
synchronized, and the lab's clock may run slower.
"""

from __future__ import annotations

from dataclasses import dataclass

from drake_dress.models.supervision.fault import FATAL, TELLING, Fault, Finding
from drake_dress.models.supervision.order import order

__all__ = ["FATAL", "TELLING", "Arrival", "Fault", "WatchSettings", "WatchState", "watch"]


@dataclass(frozen=True)
class WatchSettings:
    """Requirements on a source.

    Attributes:
        max_age: greatest time since the last sound message, s.
        jump: time by which a stamp may advance more than time did, s.
        late: time by which a stamp may be before the newest one, s; such a message is dropped.
    """

    max_age: float
    jump: float = 0.5
    late: float = 0.05


@dataclass(frozen=True)
class Arrival:
    """Messages received from a source until now.

    Attributes:
        count: number of messages, sound or not, without those that were dropped.
        stamp: time stamp of the last message of the right kind, s of its source's clock.
        fault: fault of the last message; NONE if it was sound.
        reason: reason of that fault, as of `Finding`.
        dropped: number of repeated or late messages.
    """

    count: int = 0
    stamp: float = 0.0
    fault: Fault = Fault.NONE
    reason: str = ""
    dropped: int = 0


@dataclass(frozen=True)
class WatchState:
    """State of a watch.

    Attributes:
        count: number of messages looked at.
        stamp: time stamp of the last sound one, s; None before the first.
        heard: time at which it was looked at, s of the watch's own clock. The first one may have
            arrived earlier.
        fault: current fault.
        came: whether a sound message followed the first one, so that `heard` is its arrival time.
        reason: reason of the fault; of a fatal fault, the first reason.
        total: number of all messages, including dropped ones, when the last sound one had come.
    """

    count: int = 0
    stamp: float | None = None
    heard: float = 0.0
    fault: Fault = Fault.STALE
    came: bool = False
    reason: str = ""
    total: int = 0


def watch(state: WatchState, arrival: Arrival, now: float, settings: WatchSettings) -> WatchState:
    """Returns the state of a watch at `now`, s.

    A fatal fault stays; any other fault is cleared by a sound message.
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
    """Returns the finding about the last message; None if it is to be dropped."""
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
    """Returns the finding about a source that sends nothing new.

    Args:
        stamp: time stamp of its last sound message, s; None if there was none.
        messages_came: whether messages came since, none of them new.
    """
    if stamp is None or not messages_came:
        return Finding(Fault.STALE)
    if stamp == 0.0:
        return Finding(Fault.UNSTAMPED, "utime is never filled in: it is 0 in each message")
    return Finding(Fault.STALE, f"messages come, and utime stands still at {stamp:.3f} s")
