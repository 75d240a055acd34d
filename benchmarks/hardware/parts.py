"""The measurements of the hardware path and their results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.hardware.faults import inject
from benchmarks.hardware.two_processes import Plan, play_usable
from drake_dress.errors import UserError
from drake_dress.report.summary import read_summary

# Beliefs are faults, too: implausible content of messages.
PARTS = ("commands", "dressing", "soak", "faults", "beliefs")
# On two cores a lab keeps up with real time only with a coarse garment.
_COARSE = [
    "plant.spacing=0.035",
    "plant.time_step=0.005",
    "plant.body_time_step=0.005",
    "controller.command_rate=200",
]
_COARSER = ["plant.spacing=0.05", "controller.spacing=0.06"]
# Share of the samples before memory settles, because of loading and compiling, and number of
# samples at the end while processes close down.
_LOADING, _CLOSING = 0.25, 5
_HOURS_A_WEEK = 168.0


@dataclass(frozen=True)
class Case:
    """One measurement: `part` of PARTS, and the `kind` of a fault.

    `seed` is the seed of a fault, or the number of a repeated measurement of commands.
    """

    part: str
    kind: str = ""
    seed: int = 0

    @property
    def name(self) -> str:
        """Name for files and tables."""
        if self.part in ("faults", "commands"):
            return f"{self.kind or self.part}-{self.seed:04d}"
        return self.part


@dataclass(frozen=True)
class Conditions:
    """Conditions of the measurements.

    Attributes:
        scenario: Scenario file of lab and run.
        rate: Rate of the dressing, simulated seconds per second. fault_rate: Rate of the faults.
        minutes: Duration of the soak test, min.
        report: Whether lab and run write report and replay, too.
    """

    scenario: str
    rate: float
    fault_rate: float
    minutes: float
    report: bool = False


def run(
    case: Case, conditions: Conditions, out: Path, overrides: Sequence[str] = ()
) -> dict[str, Any]:
    """Executes one measurement; returns its "summary", or the "problem" that prevented it.

    Args:
        case: Measurement to execute.
        conditions: Conditions of the measurement.
        out: Output directory of lab and run.
        overrides: Further KEY=VALUE settings of both.
    """
    try:
        summary = _measured(case, conditions, out, overrides)
    except (UserError, RuntimeError) as error:
        return {"case": asdict(case), "problem": str(error)}
    return {"case": asdict(case), "summary": summary}


def _measured(
    case: Case, conditions: Conditions, out: Path, overrides: Sequence[str]
) -> dict[str, Any]:
    if case.part == "commands":
        return _commands(conditions, out, overrides)
    if case.part == "dressing":
        return _dressing(conditions, out, overrides)
    if case.part == "soak":
        return _soak(conditions, out, overrides)
    return inject(
        case.kind,
        case.seed,
        conditions.scenario,
        out,
        conditions.fault_rate,
        overrides,
        conditions.report,
    )


def _commands(conditions: Conditions, out: Path, overrides: Sequence[str]) -> dict[str, Any]:
    play_usable(_plan(conditions, out, [*_COARSE, "duration=30", *overrides]))
    summary = read_summary(out / "run" / "summary.json")
    return {key: summary[key] for key in ("command_rate_hz", "command_latency_ms", "start_up_s")}


def _dressing(conditions: Conditions, out: Path, overrides: Sequence[str]) -> dict[str, Any]:
    rate = conditions.rate
    done = play_usable(_plan(conditions, out, overrides, rate=rate, timeout=1200.0))
    sides = {"run": done.run_status, "lab": done.lab_status}
    keys = ("reason", "dressing_time_s", "max_gripper_force_N")
    summaries = {name: read_summary(out / name / "summary.json") for name in sides}
    of_run = ("command_rate_hz", "command_latency_ms", "start_up_s")
    return {
        "rate": rate,
        **{
            name: {"status": status, **{key: summaries[name][key] for key in keys}}
            for name, status in sides.items()
        },
        **{key: summaries["run"][key] for key in of_run},
    }


def _soak(conditions: Conditions, out: Path, overrides: Sequence[str]) -> dict[str, Any]:
    # so coarse that the dressing fails; otherwise the run would end
    duration = 60.0 * conditions.minutes
    settings = [*_COARSE, *_COARSER, f"duration={duration}", *overrides]
    done = play_usable(_plan(conditions, out, settings, timeout=duration + 300.0, sampled=True))
    # later samples are from the end of the processes
    count = int(duration)
    if len(done.run_memory) < count:
        raise RuntimeError(f"they ran for {len(done.run_memory)} s, expected {count}")
    memory = {"run": done.run_memory[:count], "lab": done.lab_memory[:count]}
    return {
        "minutes": conditions.minutes,
        **{name: growth(values) for name, values in memory.items()},
    }


def _plan(conditions: Conditions, out: Path, settings: Sequence[str], **words: Any) -> Plan:
    """Returns a plan with the common settings of all measurements."""
    return Plan(conditions.scenario, str(out), list(settings), report=conditions.report, **words)


def growth(memory: Sequence[float]) -> dict[str, float]:
    """Returns the growth of memory: first and last MB, MB/h, and an upper bound of MB per week.

    The bound is the slope plus twice its standard error, for samples once per second.

    Args:
        memory: Memory once per second, MB; NaN if not known.

    Raises:
        RuntimeError: There are too few samples.
    """
    values = np.array([m for m in memory if np.isfinite(m) and m > 0.0])
    settled = values[int(_LOADING * len(values)) : -_CLOSING]
    if len(settled) < 3:
        raise RuntimeError(f"{len(settled)} samples of memory once it is settled, expected 3")
    hours = np.arange(len(settled)) / 3600.0
    fit = np.polyfit(hours, settled, 1)
    error = (settled - np.polyval(fit, hours)).std() / np.sqrt(len(settled)) / hours.std()
    return {
        "first": float(settled[0]),
        "last": float(settled[-1]),
        "per_hour": float(fit[0]),
        "week_at_most": float(_HOURS_A_WEEK * (fit[0] + 2.0 * error)),
    }
