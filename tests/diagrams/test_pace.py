"""A run that drives hardware does not make up for lost time."""

from __future__ import annotations

import time

import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from drake_dress.diagrams.pace import SteadyPace

_PERIOD, _STALL = 0.01, 0.3


class _Commands(LeafSystem):
    """Stalls once, and records the time of each command."""

    def __init__(self) -> None:
        super().__init__()
        self.left: list[float] = []
        self.DeclarePeriodicPublishEvent(_PERIOD, 0.0, self._send)

    def _send(self, context: Context) -> EventStatus:
        if len(self.left) == 20:
            time.sleep(_STALL)
        self.left.append(time.perf_counter())
        return EventStatus.Succeeded()


def test_commands_after_a_stall_are_as_far_apart_as_before() -> None:
    commands = _Commands()
    simulator = Simulator(commands)
    simulator.set_target_realtime_rate(1.0)
    simulator.Initialize()
    pace = SteadyPace(simulator)
    simulator.AdvanceTo(0.4)
    # averaged after the stall, because one command may be early or late on a busy machine
    after = commands.left[22:38]
    assert (after[-1] - after[0]) / (len(after) - 1) > 0.8 * _PERIOD
    assert pace.lost > _STALL - 0.1


def test_a_run_that_keeps_up_loses_nothing() -> None:
    wall = [0.0]
    simulator = Simulator(_Commands())
    simulator.set_target_realtime_rate(0.5)
    simulator.Initialize()
    pace = SteadyPace(simulator, lambda: wall[0])
    simulator.set_target_realtime_rate(0.0)
    for k in range(1, 15):
        # always a little behind
        wall[0] = 2.0 * _PERIOD * k + 0.04
        simulator.AdvanceTo(_PERIOD * k)
    assert pace.lost == 0.0
    wall[0] += 1.0
    simulator.AdvanceTo(0.15)
    assert pace.lost == pytest.approx(1.02, abs=1e-9)
