"""A simulated lab in its own process: arms, garment and person behind hardware messages."""

from __future__ import annotations

import sys
import time as clock
from pathlib import Path

from pydrake.systems.analysis import Simulator
from rich.console import Console

from drake_dress.diagrams.arms import ArmReachError
from drake_dress.diagrams.assemble import simulated_station
from drake_dress.diagrams.hardware_station import NoBusError, open_bus
from drake_dress.diagrams.lab_diagram import LabDiagram, make_lab
from drake_dress.diagrams.run import NOT_DRESSED, concluded
from drake_dress.diagrams.run_log import open_run_log
from drake_dress.diagrams.scenario import Scenario, apply_variation
from drake_dress.diagrams.setup import read_setup
from drake_dress.diagrams.studio import Studio
from drake_dress.errors import UserError
from drake_dress.file_output import RUN_FILES, claimed, remove_results
from drake_dress.interrupt import Interrupt, caught_interrupt
from drake_dress.machine import left_out_of_garbage
from drake_dress.models.arm.command_guard import Stop
from drake_dress.models.sides import SIDES
from drake_dress.report.log_writer import RunLogWriter
from drake_dress.systems.worker_process import WorkerProcess

# Printed once statuses are being sent.
OPEN = "the lab is open"
_CHUNK = 0.05


def run_lab(
    scenario: Scenario, source: Path, out: Path, realtime_rate: float = 1.0, report: bool = True
) -> int:
    """Runs a scenario's lab until commands stop coming; returns the exit status.

    Args:
        scenario: loaded and validated; its variation is drawn here from its seed.
        source: the scenario's file, for messages and paths relative to it.
        out: directory to write to.
        realtime_rate: largest number of simulated seconds per second.
        report: whether report and replay are written in addition to log and summary.

    Raises:
        UserError: the garment or the arms cannot be used, or there is no bus.
    """
    scenario = apply_variation(scenario)
    if scenario.station.arms.model != "panda":
        raise UserError(str(source), "station.arms.model", "is floating, expected panda")
    setup = read_setup(scenario, source)
    url = scenario.station.hardware.lcm_url
    try:
        lcm = open_bus(url)
        station = simulated_station(setup)
    except ArmReachError as error:
        raise UserError(str(source), "station.arms", str(error)) from error
    except NoBusError as error:
        raise UserError(str(source), "station.hardware.lcm_url", str(error)) from error
    take = None
    if scenario.station.cameras:
        take = WorkerProcess(Studio(setup.station)).submit
    with claimed("--out", out):
        with (
            caught_interrupt() as interrupt,
            open_run_log(out, setup, station) as writer,
        ):
            lab = make_lab(setup, station, lcm, writer, take)
            simulator = _rehearsed(lab, realtime_rate)
            # a full garbage collection takes 0.1 s, during which no status would be sent
            with left_out_of_garbage():
                heard, ended, wall_time = _play(lab, simulator, scenario, writer, interrupt)
        signal = interrupt if ended is None else None
        if not heard:
            remove_results(out, RUN_FILES[:1])
            print(f"no run: {ended}" if signal is None else signal.word)
            return NOT_DRESSED if signal is None else signal.status
        return concluded(out, wall_time, report, signal)


def _rehearsed(lab: LabDiagram, realtime_rate: float) -> Simulator:
    """Returns the lab's simulator after a rehearsal, whose compilation takes up to a minute."""
    simulator = Simulator(lab.diagram)
    simulator.set_target_realtime_rate(realtime_rate)
    cloth = lab.station.cloth
    cloth.rehearse(cloth.GetMyContextFromRoot(simulator.get_context()))
    simulator.Initialize()
    return simulator


def _play(
    lab: LabDiagram,
    simulator: Simulator,
    scenario: Scenario,
    writer: RunLogWriter,
    interrupt: Interrupt,
) -> tuple[bool, str | None, float]:
    """Runs until commands stop coming.

    Returns whether any came, why the run ended unless by a signal, and its wall time, s.
    """
    root = simulator.get_context()
    at = lab.player.GetMyContextFromRoot(root)
    station = lab.station.diagram
    inside = station.GetMyContextFromRoot(root)
    console = Console(stderr=True)
    begun_at: float | None = None
    now, told, stops = 0.0, 0.0, dict.fromkeys(SIDES, Stop.NONE)
    events: list[tuple[float, str]] = []
    ended: str | None = None
    while not interrupt.is_set() and ended is None:
        now += _CHUNK
        simulator.AdvanceTo(now)
        if now == _CHUNK:
            print(f"{OPEN}: {scenario.station.hardware.lcm_url}", flush=True)
            simulator.ResetStatistics()
        since = float(lab.player.GetOutputPort("since").Eval(at)[0])
        idle = float(lab.player.GetOutputPort("idle").Eval(at)[0])
        if since < 0.0:
            if now >= scenario.lab.wait:
                ended = f"no commands came for {scenario.lab.wait:g} s"
            continue
        if begun_at is None:
            begun_at = clock.perf_counter()
            console.print("commands come", highlight=False)
        for side in SIDES:
            stop = Stop(int(station.GetOutputPort(f"cheat_{side}_arm_stop").Eval(inside)[0]))
            if stop is not stops[side]:
                line = f"{side} arm: " + (
                    "follows" if stop is Stop.NONE else f"holds, {stop.name.lower()}"
                )
                events.append((since, line))
                stops[side] = stop
        if since - told >= 5.0 - 1e-9:
            told = since
            print(f"{since:5.1f} s", file=sys.stderr, flush=True)
        if idle >= scenario.lab.rest:
            ended = "commands ended"
    writer.note("events", "\n".join(f"{t:.3f} {line}" for t, line in events))
    wall = 0.0 if begun_at is None else clock.perf_counter() - begun_at
    return begun_at is not None, ended, wall
