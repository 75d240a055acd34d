"""One run of a scenario, from YAML to report."""

from __future__ import annotations

import sys
import time as clock
from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.systems.analysis import Simulator
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from drake_dress import __version__
from drake_dress.diagrams.arms import ArmReachError
from drake_dress.diagrams.assemble import garments, parts, wired
from drake_dress.diagrams.dressing import Dressing, is_finished
from drake_dress.diagrams.scenario import Scenario, apply_variation, resolved_yaml
from drake_dress.errors import UserError
from drake_dress.interrupt import caught_interrupt
from drake_dress.report.log import RunLog, RunLogWriter
from drake_dress.report.measures import measure
from drake_dress.report.replay_html import write_replay_html
from drake_dress.report.report_html import write_report
from drake_dress.report.summary import summarize, write_summary

DONE, NOT_DRESSED, INTERRUPTED = 0, 1, 130
# Simulated time between looks at the stages, s, and for which both sleeves must stay done.
_CHUNK = 0.1
_STAY = 1.0


def run_scenario(
    scenario: Scenario,
    source: Path,
    out: Path,
    meshcat: bool = True,
    realtime_rate: float = 0.0,
) -> int:
    """Runs a scenario and writes log, summary, report and replay; returns the exit status.

    Args:
        scenario: loaded and validated; its variation is drawn here from its seed.
        source: the scenario's file, for messages and paths relative to it.
        out: directory to write to; made when all input has proved usable.
        meshcat: whether to show the run live.
        realtime_rate: at most this many simulated seconds per second; 0 for no limit.

    Raises:
        UserError: the garment cannot be used, or hangs where grippers may not or cannot be.
    """
    scenario = apply_variation(scenario)
    meshes, limits = garments(scenario, source)
    page = _open_meshcat() if meshcat else None

    begin = clock.perf_counter()
    try:
        p = parts(scenario, meshes, limits, page)
    except ArmReachError as error:
        raise UserError(str(source), "station.arms", str(error)) from error
    out.mkdir(parents=True, exist_ok=True)
    with RunLogWriter(
        out / "run.h5",
        garment=p.garments.plant,
        scenario_text=resolved_yaml(scenario),
        version=__version__,
        seed=scenario.seed,
        radius=p.station.person.radius,
        capsule_radius=[c.radius for c in p.station.person.capsules],
        estimate_garment=p.garments.belief,
        has_arms=p.station.robots is not None,
    ) as writer:
        dressing = wired(p, writer)
        interrupted = _simulate(dressing, scenario.duration, realtime_rate)
    wall_time = clock.perf_counter() - begin

    success, reason = _conclude(out, wall_time)
    print(f"log, report and replay: {out}")
    if interrupted:
        print("interrupted: what had run is in the log")
        return INTERRUPTED
    print("both sleeves on" if success else f"not dressed: {reason}")
    return DONE if success else NOT_DRESSED


def _open_meshcat() -> Meshcat:
    """Returns a page that listens on localhost only, and says where."""
    page = Meshcat(MeshcatParams(host="localhost"))
    print(f"live: {page.web_url()}", flush=True)
    return page


def _simulate(dressing: Dressing, duration: float, realtime_rate: float) -> bool:
    """Runs until both sleeves have stayed done for a while or time is up.

    Returns whether the user interrupted.
    """
    simulator = Simulator(dressing.diagram)
    simulator.set_target_realtime_rate(realtime_rate)
    simulator.Initialize()
    context = dressing.mpc.GetMyContextFromRoot(simulator.get_context())
    stage_port = dressing.mpc.GetOutputPort("stage")
    terminal = sys.stderr.isatty()
    console = Console(stderr=True)
    done_since, told = np.inf, 0.0
    with (
        caught_interrupt() as interrupt,
        Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:5.1f} of {task.total:.0f} s simulated"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            disable=not terminal,
        ) as progress,
    ):
        task = progress.add_task("dressing", total=duration)
        now = 0.0
        while now < duration and not interrupt.is_set():
            now = min(duration, now + _CHUNK)
            simulator.AdvanceTo(now)
            stage = stage_port.Eval(context)
            names = [("prepare", "dress", "done")[int(s)] for s in stage]
            progress.update(task, completed=now, description=f"L {names[0]}  R {names[1]}")
            if not terminal and now - told >= 5.0 - 1e-9:
                told = now
                print(f"{now:5.1f} s  left {names[0]}, right {names[1]}", file=sys.stderr)
            done_since = min(done_since, now) if is_finished(stage) else np.inf
            if now - done_since >= _STAY:
                break
        return interrupt.is_set()


def _conclude(out: Path, wall_time: float) -> tuple[bool, str | None]:
    """Writes summary, report and replay of the log in `out`; returns success and reason."""
    with RunLog.open(out / "run.h5") as log:
        measures = measure(log)
        summary = summarize(log, wall_time=wall_time, measures=measures)
        write_summary(summary, out / "summary.json")
        write_report(out, measures=measures)
        write_replay_html(log, out / "replay.html")
    return bool(summary["success"]), summary["reason"]
