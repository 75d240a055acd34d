"""Keeps a run that drives hardware from making up for lost time.

Drake's simulator keeps the average rate: after a stall of half a second it runs as fast as it can
until it has caught up, and the commands of half a second are sent within a few hundredths of one.
Instead, arms must continue at the target rate.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

# Largest lag behind the target rate that is made up for, s of real time: ten command periods.
_MOST_BEHIND = 0.05


class SteadyPace:
    """Sets a simulator's monitor, which restarts the pace when the simulation has fallen behind.

    Args:
        simulator: with its target rate set; at a rate of zero there is no pace to keep.
        now: returns real time, s.

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
