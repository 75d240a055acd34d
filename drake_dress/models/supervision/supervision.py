"""What follows from faults: arms hold at once; the run goes on, or ends.

    any source has a fault                     arms come to rest and hold
    all have been sound for settle_time        they go on
    a fault has lasted for its patience        the run ends
    a fault is fatal                           the run ends once arms have come to rest

When a run ends, commands end, and the arms' own drivers hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drake_dress.models.supervision.fault import FATAL, Fault


@dataclass(frozen=True)
class Patience:
    """How long is waited.

    Attributes:
        settle_time: for which all must have been sound before arms go on, s.
        fault: that a fault may last, s. fatal: until arms have come to rest, s.
    """

    settle_time: float = 0.2
    fault: float = 3.0
    fatal: float = 0.3


@dataclass(frozen=True)
class SupervisionState:
    """What is remembered.

    Attributes:
        faults: of each source, gathered since arms were permitted to move last.
        since: when its first fault since then was, s; None where it had none.
        sound: since when all are sound, s; None while one is not.
        permitted: whether arms may move.
        ended_by: the source whose fault ends the run; None while it goes on.
    """

    faults: tuple[Fault, ...]
    since: tuple[float | None, ...]
    sound: float | None = None
    permitted: bool = False
    ended_by: int | None = None

    @staticmethod
    def of(count: int) -> SupervisionState:
        """Returns the state before anything has been heard of so many sources."""
        return SupervisionState((Fault.NONE,) * count, (None,) * count)


def supervise(
    state: SupervisionState, faults: Sequence[Fault], now: float, patience: Patience
) -> SupervisionState:
    """Returns what follows from the sources' faults at `now`, s.

    Before all have been sound once, nothing is permitted, and patience runs from time 0.
    """
    sound = None
    if not any(faults):
        sound = now if state.sound is None else state.sound
    settled = sound is not None and now - sound >= patience.settle_time - 1e-9
    since: list[float | None] = []
    gathered: list[Fault] = []
    ended_by = state.ended_by
    for i, fault in enumerate(faults):
        # of a source that comes and goes, patience runs on while it holds arms
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
    """Returns a line about what is wrong with a source: what was refused and why, if known."""
    return f"{source}: {reason} ({words(fault)})" if reason else f"{source}: {words(fault)}"


def words(fault: Fault) -> str:
    """Returns the names of faults."""
    names = [name for name, f in Fault.__members__.items() if f and f & fault]
    return ", ".join(names).lower().replace("_", " ")
