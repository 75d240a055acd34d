"""Monitors the messages that a station receives and decides whether arms may move."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_dress.models.immutable import Immutable
from drake_dress.models.supervision.fault import TELLING
from drake_dress.models.supervision.supervision import (
    Patience,
    SupervisionState,
    supervise,
    told,
)
from drake_dress.models.supervision.watch import Arrival, WatchSettings, WatchState, watch
from drake_dress.systems.lcm_inbox import Received

# Number of events kept, from the first on; a source that flaps must not fill the memory.
_REMEMBERED = 10_000


@dataclass(frozen=True)
class _Memory(Immutable):
    watched: tuple[WatchState, ...]
    supervised: SupervisionState
    # time, s, and description of each change
    events: tuple[tuple[float, str], ...] = ()
    # number of repeated or late messages of each source
    dropped: tuple[int, ...] = ()


class StationWatch(LeafSystem):
    """Monitors message sources; see `models/supervision/`.

    .. pydrake_system::

        name: StationWatch
        input_ports:
        - source (one for each, of its name)
        output_ports:
        - permission
        - faults
        - ended_by
        - source_valid (one for each)
        - source_stopped (one for each)

    Sources: `Received`. permission: (1,) 1 while arms may move. faults: (k,) for each source, flags
    of `models.supervision.watch.Fault`. ended_by: (1,) number of the source that ends the run, -1
    if none does. *_valid: (1,) 1 while the source has no fault; *_stopped: (1,) 1 while it reports
    that it does not follow commands. In addition to the ports, `events` returns the changes in a
    context, and `dropped` the number of repeated and late messages of each source.

    Args:
        sources: By name, the requirements on each source.
        patience: How long faults are tolerated.
        period: Period of the update, s.
        wall: Whether to use this machine's monotonic clock instead of the diagram's time, which
            falls behind during long steps.
    """

    def __init__(
        self,
        sources: Mapping[str, WatchSettings],
        patience: Patience,
        period: float,
        wall: bool = False,
    ) -> None:
        super().__init__()
        self._wall = wall
        self.sources = tuple(sources)
        self._settings = tuple(sources.values())
        self._patience = patience
        count = len(self.sources)
        self._memory = self.DeclareAbstractState(
            Value(_Memory((WatchState(),) * count, SupervisionState.of(count), (), (0,) * count))
        )
        for name in self.sources:
            self.DeclareAbstractInputPort(name, Value(Received()))
        ticket = {self.abstract_state_ticket(self._memory)}

        def declare(name: str, size: int, of: Callable[[_Memory], list[float]]) -> None:
            def calc(context: Context, output: BasicVector) -> None:
                output.SetFromVector(of(context.get_abstract_state(self._memory).get_value()))

            self.DeclareVectorOutputPort(name, size, calc, ticket)

        declare("permission", 1, lambda m: [float(m.supervised.permitted)])
        declare("faults", count, lambda m: [float(w.fault) for w in m.watched])
        declare("ended_by", 1, lambda m: [_number(m.supervised.ended_by)])
        for i, name in enumerate(self.sources):
            declare(f"{name}_valid", 1, partial(_valid, i))
            declare(f"{name}_stopped", 1, partial(_stopped, i))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: State) -> None:
        memory: _Memory = context.get_abstract_state(self._memory).get_value()
        now = clock.monotonic() if self._wall else context.get_time()
        arrivals: list[Arrival] = [
            self.get_input_port(i).Eval(context).arrival for i in range(len(self.sources))
        ]
        watched = tuple(
            watch(w, arrival, now, settings)
            for w, arrival, settings in zip(memory.watched, arrivals, self._settings, strict=True)
        )
        supervised = supervise(memory.supervised, [w.fault for w in watched], now, self._patience)
        events = memory.events
        if len(events) < _REMEMBERED:
            lines = self._changes(memory, watched, supervised)
            lines += self._dropping(memory.dropped, arrivals)
            events += tuple((context.get_time(), line) for line in lines)
            if len(events) >= _REMEMBERED:
                events += (
                    (context.get_time(), "further changes are not noted: there were too many"),
                )
        dropped = tuple(arrival.dropped for arrival in arrivals)
        memory = _Memory(watched, supervised, events, dropped)
        state.get_mutable_abstract_state(self._memory).set_value(memory)

    def _changes(
        self,
        before: _Memory,
        watched: tuple[WatchState, ...],
        supervised: SupervisionState,
    ) -> list[str]:
        lines = [
            told(self._told(i), w.fault, w.reason) if w.fault else f"{self._told(i)}: sound"
            for i, (old, w) in enumerate(zip(before.watched, watched, strict=True))
            if old.fault != w.fault
        ]
        if before.supervised.permitted != supervised.permitted:
            lines.append("arms may move" if supervised.permitted else "arms hold")
        return lines

    def _dropping(self, before: tuple[int, ...], arrivals: list[Arrival]) -> list[str]:
        return [
            f"{self._told(i)}: a repeated or late message is dropped"
            for i, (count, arrival) in enumerate(zip(before, arrivals, strict=True))
            if arrival.dropped and not count
        ]

    def _told(self, i: int) -> str:
        return self.sources[i].replace("_", " ")

    def events(self, context: Context) -> tuple[tuple[float, str], ...]:
        """Returns the changes and their times, s, from this system's own context."""
        memory: _Memory = context.get_abstract_state(self._memory).get_value()
        return memory.events

    def dropped(self, context: Context) -> dict[str, int]:
        """Returns the number of repeated or late messages by source, from the system's context."""
        memory: _Memory = context.get_abstract_state(self._memory).get_value()
        return dict(zip(self.sources, memory.dropped, strict=True))

    def conclusion(self, context: Context) -> str | None:
        """Returns why the run ends, from this system's own context; None while it continues."""
        memory: _Memory = context.get_abstract_state(self._memory).get_value()
        i = memory.supervised.ended_by
        if i is None:
            return None
        return told(self._told(i), memory.supervised.faults[i], memory.watched[i].reason)


def _valid(i: int, memory: _Memory) -> list[float]:
    return [float(not memory.watched[i].fault)]


def _stopped(i: int, memory: _Memory) -> list[float]:
    return [float(bool(memory.watched[i].fault & TELLING))]


def _number(index: int | None) -> float:
    return -1.0 if index is None else float(index)
