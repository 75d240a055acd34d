"""Reactions to faults: the arms hold at once, and the run goes on or ends.

    any source has a fault                     the arms come to rest and hold
    all have been sound for settle_time        the arms resume
    a fault has lasted for its patience        the run ends
    a fault is fatal                           the run ends once the arms have come to rest

When a run ends, no more commands are sent, and the arms' own drivers hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drake_dress.models.supervision.fault import FATAL, Fault


@dataclass(frozen=True)
class Patience:
    """Waiting times.

    Attributes:
        settle_time: time for which all sources must be sound before the arms resume, s.
        fault: time that a fault may last, s. fatal: time for the arms to come to rest, s.
    """

    settle_time: float = 0.2
    fault: float = 3.0
    fatal: float = 0.3


@dataclass(frozen=True)
class SupervisionState:
    """State of the supervision.

    Attributes:
        faults: of each source, accumulated since the arms were last permitted to move.
        since: time of its first fault since then, s; None if it had none.
        sound: time since which all sources are sound, s; None while one is not.
        permitted: whether the arms may move.
        ended_by: the source whose fault ends the run; None while it goes on.
    """

    faults: tuple[Fault, ...]
    since: tuple[float | None, ...]
    sound: float | None = None
    permitted: bool = False
    ended_by: int | None = None

    @staticmethod
    def of(count: int) -> SupervisionState:
        """Returns the state of `count` sources before the first message."""
        return SupervisionState((Fault.NONE,) * count, (None,) * count)


def supervise(
    state: SupervisionState, faults: Sequence[Fault], now: float, patience: Patience
) -> SupervisionState:
    """Returns the state after the sources' faults at `now`, s.

    Until all sources have been sound once, no motion is permitted, and patience runs from time 0.
    """
    sound = None
    if not any(faults):
        sound = now if state.sound is None else state.sound
    settled = sound is not None and now - sound >= patience.settle_time - 1e-9
    since: list[float | None] = []
    gathered: list[Fault] = []
    ended_by = state.ended_by
    for i, fault in enumerate(faults):
        # patience with an intermittent source runs on while that source holds the arms
        began = None if settled else state.since[i]
        all_of_it = Fault.NONE if settled else state.faults[i] | fault
        if fault and began is None:
            began = now
        since.append(began)
        gathered.append(all_of_it)
        allowed = patience.fatal if all_of_it & FATAL else patience.fault
        if ended_by is None and fault and began is not None and now - began >= allowed:
            ended_by = i
    permitted = ended_by is None and sound is not None and (state.permitted or settled)
    return SupervisionState(tuple(gathered), tuple(since), sound, permitted, ended_by)


def told(source: str, fault: Fault, reason: str = "") -> str:
    """Returns a line about the fault of a source, with what was rejected and why, if known."""
    return f"{source}: {reason} ({words(fault)})" if reason else f"{source}: {words(fault)}"


def words(fault: Fault) -> str:
    """Returns the names of faults."""
    names = [name for name, f in Fault.__members__.items() if f and f & fault]
    return ", ".join(names).lower().replace("_", " ")
