"""One run of a scenario, from YAML to report."""

from __future__ import annotations

import sys
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from drake_dress.diagrams.arms import ArmReachError
from drake_dress.diagrams.assemble import (
    Parts,
    hardware_parts,
    parts,
    person_predictor,
    wired,
)
from drake_dress.diagrams.dressing import Dressing
from drake_dress.diagrams.garment_fit import check_fit
from drake_dress.diagrams.hardware_station import (
    NoBusError,
    NotAtStartError,
    StationSilentError,
)
from drake_dress.diagrams.own_parts import NOTHING, OwnParts
from drake_dress.diagrams.pace import SteadyPace
from drake_dress.diagrams.run_log import open_run_log
from drake_dress.diagrams.scenario import Scenario, apply_variation
from drake_dress.diagrams.setup import Setup, read_setup
from drake_dress.errors import UserError
from drake_dress.file_output import RUN_FILES, claimed
from drake_dress.interrupt import Interrupt, caught_interrupt
from drake_dress.machine import left_out_of_garbage
from drake_dress.models.human.learned.forecast import PersonPredictor
from drake_dress.report.log import RunLog
from drake_dress.report.log_schema import STAGE_NAMES
from drake_dress.report.measures import Measures, measure
from drake_dress.report.replay_html import write_replay_html
from drake_dress.report.summary import summarize, write_summary
from drake_dress.report.web_page import open_page

DONE, NOT_DRESSED = 0, 1
_CHUNK = 0.1  # simulated time between checks of the stages, s


@dataclass(frozen=True)
class RunOptions:
    """Options of a run.

    Attributes:
        meshcat: whether to show the run live.
        realtime_rate: largest number of simulated seconds per second; 0 means no limit (1 on
            hardware).
        in_workers: whether the simulated garment is stepped, and the global controller solves, in
            worker processes.
        report: whether report and replay are written in addition to log and summary.
        told: called with each line that says where the run is shown or how it ended.
    """

    meshcat: bool = True
    realtime_rate: float = 0.0
    in_workers: bool = False
    report: bool = True
    told: Callable[[str], None] = partial(print, flush=True)


def run_scenario(
    scenario: Scenario,
    source: Path,
    out: Path,
    options: RunOptions = RunOptions(),
    own: OwnParts = NOTHING,
) -> int:
    """Runs a scenario and writes log, summary, report and replay; returns the exit status.

    Results of an earlier run in `out` are removed. If a signal ends the run, the log holds what was
    simulated until then.

    Args:
        scenario: loaded and validated; its variation is drawn here from its seed.
        source: the scenario's file, for messages and paths relative to it.
        out: directory to write to; created once all input has proved usable.
        options: of the run.
        own: the user's own parts.

    Raises:
        UserError: the garment cannot be used, cannot go on, or hangs where grippers may not or
            cannot be; or hardware is silent, or not at the start of the run; or another run writes
            to `out`.
    """
    setup = read_setup(apply_variation(scenario), source)
    check_fit(setup)
    page = _open_meshcat(options.told) if options.meshcat else None
    p = _parts(setup, page, options.in_workers, own)
    rate = options.realtime_rate
    if p.station.in_real_time:
        rate = rate or 1.0

    with claimed("--out", out):
        begin = clock.perf_counter()
        with (
            caught_interrupt() as interrupt,
            open_run_log(out, p.setup, p.station, forecasts_of(p)) as writer,
        ):
            dressing = wired(p, writer)
            simulator = Simulator(dressing.diagram)
            with left_out_of_garbage():
                ending = _simulate(dressing, simulator, scenario.duration, rate, interrupt)
            p.station.note(simulator.get_context(), writer)
            if p.station.in_real_time:
                writer.note("behind", ending.behind)
            if ending.fault is not None:
                writer.note("ended_by", ending.fault)
        wall_time = clock.perf_counter() - begin
        by = interrupt if ending.interrupted else None
        return concluded(out, wall_time, options.report, by, options.told)


def forecasts_of(p: Parts) -> bool:
    """Returns whether the predictor of a run forecasts the person, so that this is logged."""
    return isinstance(person_predictor(p), PersonPredictor)


def _parts(setup: Setup, page: Meshcat | None, in_worker: bool, own: OwnParts) -> Parts:
    """Returns the parts of the diagram; problems with arms or hardware become user errors."""
    source, station = str(setup.source), setup.scenario.station
    arms, hardware = "station.arms", "station.hardware"
    try:
        if station.kind == "simulated":
            return parts(setup, page, in_worker, own)
        with caught_interrupt() as interrupt:
            print(f"listening: {station.hardware.lcm_url}", flush=True)
            p = hardware_parts(
                setup,
                page,
                lambda name: print(f"heard: {name.replace('_', ' ')}", flush=True),
                interrupt.is_set,
                own,
            )
        if interrupt.is_set():
            raise interrupt.error()
        return p
    except ArmReachError as error:
        raise UserError(source, arms, str(error)) from error
    except NoBusError as error:
        raise UserError(source, f"{hardware}.lcm_url", str(error)) from error
    except (StationSilentError, NotAtStartError) as error:
        if isinstance(error, StationSilentError) and interrupt.is_set():
            raise interrupt.error() from None
        raise UserError(source, hardware, str(error)) from error


def _open_meshcat(told: Callable[[str], None]) -> Meshcat | None:
    """Opens a page that listens on localhost only and reports its URL; None if that fails."""
    try:
        page = open_page()
    except UserError as error:
        print(f"no live page: {error.message}; the run goes on without", file=sys.stderr)
        return None
    told(f"live: {page.web_url()}")
    return page


@dataclass(frozen=True)
class Ending:
    """Why a run ended early: a signal, or a fault of station, controller or log.

    `behind` is the real time, s, by which a run on hardware fell behind its target rate.
    """

    interrupted: bool = False
    fault: str | None = None
    behind: float = 0.0


def _simulate(
    dressing: Dressing,
    simulator: Simulator,
    duration: float,
    realtime_rate: float,
    interrupt: Interrupt,
) -> Ending:
    """Runs until the dressing has been finished for a while, time is up, or a fault ends it."""
    simulator.set_target_realtime_rate(realtime_rate)
    station = dressing.station
    station.make_ready(partial(dressing.rehearse, stopped=interrupt.is_set))
    if station.in_real_time and interrupt.is_set():
        return Ending(interrupted=True)
    simulator.Initialize()
    pace = SteadyPace(simulator) if station.in_real_time else None
    context = dressing.mpc.GetMyContextFromRoot(simulator.get_context())
    stage_port = dressing.mpc.GetOutputPort("stage")
    terminal = sys.stderr.isatty()
    console = Console(stderr=True)
    done_since, told = np.inf, 0.0
    fault: str | None = None
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:5.1f} of {task.total:.0f} s simulated"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=not terminal,
    ) as progress:
        task = progress.add_task("dressing", total=duration)
        now = 0.0
        while now < duration and not interrupt.is_set() and fault is None:
            now = min(duration, now + _CHUNK)
            try:
                simulator.AdvanceTo(now)
            except OSError as error:
                # no command is sent unlogged: commands end here, and the arms stop by themselves
                fault = f"log: cannot be written: {error}"
                break
            fault = station.fault(simulator.get_context()) or dressing.mpc.failure(context)
            stage = stage_port.Eval(context)
            names = [STAGE_NAMES[int(s)] for s in stage]
            progress.update(task, completed=now, description=f"L {names[0]}  R {names[1]}")
            if not terminal and now - told >= 5.0 - 1e-9:
                told = now
                print(f"{now:5.1f} s  left {names[0]}, right {names[1]}", file=sys.stderr)
            finished = dressing.mpc.is_finished(context)
            done_since = min(done_since, now) if finished else np.inf
            if now - done_since >= dressing.mpc.watch_time:
                break
        return Ending(interrupt.is_set(), fault, 0.0 if pace is None else pace.lost)


def concluded(
    out: Path,
    wall_time: float,
    report: bool,
    interrupt: Interrupt | None,
    told: Callable[[str], None] = print,
) -> int:
    """Calls `conclude`, reports how the run ended and returns the exit status.

    Args:
        out: directory of the run.
        wall_time: of the run, s.
        report: whether report and replay are written.
        interrupt: the signal that ended it, if one did.
        told: called with each line of the outcome.
    """
    success, reason = conclude(out, wall_time, report, told)
    if interrupt is not None:
        told(f"{interrupt.word}: what had run is in the log")
        return interrupt.status
    told("both sleeves on" if success else f"not dressed: {reason}")
    return DONE if success else NOT_DRESSED


def conclude(
    out: Path, wall_time: float, report: bool = True, told: Callable[[str], None] = print
) -> tuple[bool, str | None]:
    """Writes the summary of the log in `out`, and report and replay if they are wanted.

    The files are independent: one that cannot be written is reported and does not stop the others.

    Returns:
        Success, and the reason for a failure.
    """
    log_file, summary_file, report_file, replay_file = (out / name for name in RUN_FILES)
    with RunLog.open(log_file) as log:
        measures = measure(log)
        summary = summarize(log, wall_time=wall_time, measures=measures)
        written = [_written(summary_file, lambda: write_summary(summary, summary_file))]
        if report:
            written.append(_written(report_file, lambda: _write_report(out, measures)))
            written.append(_written(replay_file, lambda: write_replay_html(log, replay_file)))
    if all(written):
        told(f"{'log, report and replay' if report else 'log and summary'}: {out}")
    else:
        told(f"log: {log_file}")
    return bool(summary["success"]), summary["reason"]


def _write_report(out: Path, measures: Measures) -> None:
    # importing its plots takes a second, for which no robot should wait
    from drake_dress.report.report_html import write_report

    write_report(out, measures=measures)


def _written(path: Path, write: Callable[[], object]) -> bool:
    """Writes a file of a finished run; returns whether that succeeded, and reports a failure."""
    try:
        write()
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        print(f"drake-dress: {path}: cannot be written: {reason}", file=sys.stderr)
        return False
    return True
