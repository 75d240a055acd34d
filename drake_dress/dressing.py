"""Dressings in Python: scenarios, the whole diagram, runs, logs, and your own parts.

    from drake_dress import dressing

    scenario = dressing.load_scenario("dummy_standing", ["plant.fidelity=quick"], seed=3)
    result = dressing.run(scenario, "out/mine")
    print(result.success, result.summary["dressing_time_s"])

    with dressing.open_log("out/mine/run.h5") as log:
        print(log.time[-1])

`make_dressing` returns the Drake diagram without running it. `OwnParts` adds your own predictor,
costs or controller to a run or a diagram; `register_cost` and `register_predictor` make costs and
predictors available as scenario keys. The names in `__all__` are public.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydrake.geometry import Meshcat

from drake_dress.diagrams import scenario as scenarios
from drake_dress.diagrams.assemble import parts, wired
from drake_dress.diagrams.dressing import Dressing
from drake_dress.diagrams.own_parts import NOTHING, OwnParts
from drake_dress.diagrams.run import RunOptions, run_scenario
from drake_dress.diagrams.scenario import Scenario, apply_variation, checked_scenario
from drake_dress.diagrams.setup import read_setup
from drake_dress.errors import FailedError
from drake_dress.file_output import RUN_FILES, prove_directory
from drake_dress.models.control.costs import GarmentCost, PlannedStep, Slope
from drake_dress.models.control.local_control import GlobalPlan
from drake_dress.models.control.own_costs import register_cost, unregister_cost
from drake_dress.models.human.prediction import (
    ConstantVelocityPredictor,
    MotionPredictor,
    StillPredictor,
    register_predictor,
)
from drake_dress.plugins import load_plugin
from drake_dress.report.log import RunLog
from drake_dress.report.replay import show_replay
from drake_dress.report.replay_html import write_replay_html
from drake_dress.shipped import scenario_file, shipped_scenarios

__all__ = [
    "ConstantVelocityPredictor",
    "Dressing",
    "GarmentCost",
    "GlobalPlan",
    "MotionPredictor",
    "OwnParts",
    "PlannedStep",
    "RunLog",
    "RunResult",
    "Scenario",
    "Slope",
    "StillPredictor",
    "checked_scenario",
    "load_plugin",
    "load_scenario",
    "make_dressing",
    "open_log",
    "register_cost",
    "register_predictor",
    "run",
    "shipped_scenarios",
    "show_replay",
    "unregister_cost",
    "write_replay",
]


@dataclass(frozen=True)
class RunResult:
    """Result of a run.

    Attributes:
        out: directory with run.h5, summary.json, report.html and replay.html.
        success: whether both sleeves are on.
        summary: content of summary.json.
    """

    out: Path
    success: bool
    summary: dict[str, Any]

    @property
    def reason(self) -> str | None:
        """Why the dressing failed; None if it succeeded."""
        reason: str | None = self.summary["reason"]
        return reason

    def open_log(self) -> RunLog:
        """Returns the log, to be used in a `with` block."""
        return RunLog.open(self.out / RUN_FILES[0])


def load_scenario(
    scenario: str | Path, overrides: Sequence[str] = (), seed: int | None = None
) -> Scenario:
    """Returns a scenario.

    Args:
        scenario: a YAML file, or the name of a shipped scenario; see `shipped_scenarios`.
        overrides: KEY=VALUE each, as for `--set`.
        seed: replaces the scenario's own.

    Raises:
        UserError: file, key or value cannot be used.
    """
    return scenarios.load_scenario(scenario_file(str(scenario)), overrides, seed)


def make_dressing(
    scenario: Scenario,
    own: OwnParts = NOTHING,
    meshcat: Meshcat | None = None,
    base: str | Path = ".",
) -> Dressing:
    """Returns the diagram of a simulated scenario: station, estimates and controllers, unlogged.

    Args:
        scenario: its variation is drawn here from its seed.
        own: your own parts.
        meshcat: page that shows it, if any.
        base: directory that the names of garment files are relative to.

    Raises:
        UserError: a value or a garment file cannot be used.
        ValueError: one of your own parts cannot be used, or the station is hardware.
    """
    if scenario.station.kind != "simulated":
        raise ValueError(f"the station is {scenario.station.kind}, expected simulated; see `run`")
    drawn = apply_variation(checked_scenario(scenario))
    return wired(parts(read_setup(drawn, Path(base) / "scenario"), meshcat, own=own))


def run(
    scenario: Scenario,
    out: str | Path,
    own: OwnParts = NOTHING,
    *,
    meshcat: bool = False,
    realtime_rate: float = 0.0,
    report: bool = True,
    base: str | Path = ".",
    told: Callable[[str], None] = lambda _: None,
) -> RunResult:
    """Runs a scenario to its end, and writes what `drake-dress run` writes.

    Args:
        scenario: simulated or on hardware; its variation is drawn here from its seed.
        out: directory to write to; results of an earlier run in it are replaced.
        own: your own parts.
        meshcat: whether to show the run live.
        realtime_rate: largest number of simulated seconds per second; 0 means no limit (1 on
            hardware).
        report: whether report and replay are written in addition to log and summary.
        base: directory that the names of garment files are relative to.
        told: called with each line that says where the run is shown or how it ended, such as
            `print`.

    Raises:
        UserError: a value, a garment file or `out` cannot be used.
        ValueError: one of your own parts cannot be used.
        FailedError: the run ended, but its summary could not be written; the log is there.
    """
    checked, source = checked_scenario(scenario), Path(base) / "scenario"
    to = prove_directory("out", out, RUN_FILES)
    options = RunOptions(meshcat, realtime_rate, report=report, told=told)
    run_scenario(checked, source, to, options, own)
    log, summary_file = to / RUN_FILES[0], to / RUN_FILES[1]
    if not summary_file.exists():
        raise FailedError(f"{summary_file}: could not be written; the log is {log}")
    summary = json.loads(summary_file.read_text(encoding="utf-8"))
    return RunResult(to, bool(summary["success"]), summary)


def open_log(path: str | Path) -> RunLog:
    """Returns a log, to be used in a `with` block.

    Raises:
        UserError: the file is not the log of a run, or is damaged.
    """
    return RunLog.open(path)


def write_replay(log: RunLog, path: str | Path) -> None:
    """Writes a log's replay as one self-contained HTML file."""
    write_replay_html(log, Path(path))
