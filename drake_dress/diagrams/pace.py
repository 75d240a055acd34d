"""Keeps a run that drives hardware from making up for lost time.

Drake's simulator holds the average rate: after a stall of half a second it runs as fast as it can
until it is where it would have been, and commands that were to take half a second leave in a few
hundredths of one. Arms are to go on instead, at the rate that was asked for.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

# Behind the asked rate by so much real time, s, and it is given up: ten commands' worth.
_MOST_BEHIND = 0.05


class SteadyPace:
    """Takes over a simulator's monitor; real time begins anew wherever it has fallen behind.

    Args:
        simulator: with its target rate set; a rate of zero has no pace to keep.
        now: real time, s.

    Attributes:
        lost: real time given up so far, s.
    """

    def __init__(self, simulator: Simulator, now: Callable[[], float] = clock.perf_counter) -> None:
        self.lost = 0.0
        self._simulator = simulator
        self._rate = simulator.get_target_realtime_rate()
        self._now = now
        self._origin = now() * self._rate - simulator.get_context().get_time()
        if self._rate > 0.0:
            simulator.set_monitor(self._look)

    def _look(self, context: Context) -> None:
        origin = self._now() * self._rate - context.get_time()
        behind = (origin - self._origin) / self._rate
        if behind > _MOST_BEHIND:
            self.lost += behind
            self._origin = origin
            self._simulator.ResetStatistics()
