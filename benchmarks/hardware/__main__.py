"""How the hardware path does: rate and latency of commands, faults, a dressing, memory.

    drake-dress bench hardware --only commands
    drake-dress bench hardware --only faults --seeds 0-19 --json faults.json
    drake-dress bench hardware --only dressing --rate 0.35
    drake-dress bench hardware --only soak --minutes 20

A lab and a run in two processes, over LCM multicast in a network namespace with a loopback alone.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.hardware.faults import REACTIONS, FaultCase, name_of, run_case
from benchmarks.hardware.two_processes import Plan, available, play
from benchmarks.kept import read_results, seed_range, write_results
from drake_dress.errors import UserError
from drake_dress.report.log import RunLog
from drake_dress.report.summary import summarize

SCENARIO = "scenarios/lab.yaml"
# On two cores a lab keeps up with time if its garment is coarse.
_COARSE = ["plant.spacing=0.035", "plant.time_step=0.005", "controller.command_rate=200"]
_PARTS = ("commands", "faults", "dressing", "soak")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the benchmark; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="drake-dress bench hardware",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--only", metavar="PART,…", default="commands,dressing")
    parser.add_argument("--scenario", default=SCENARIO)
    parser.add_argument("--seeds", type=seed_range, default=range(20), metavar="A-B")
    parser.add_argument("--kinds", metavar="KIND,…", default=",".join(REACTIONS))
    parser.add_argument("--rate", type=float, default=0.35, help="of the dressing; default 0.35")
    parser.add_argument("--minutes", type=float, default=20.0, help="of the soak; default 20")
    parser.add_argument("--json", type=Path, metavar="FILE", help="keeps the faults' results")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keeps the logs")
    options = parser.parse_args(arguments)
    parts = options.only.split(",")
    for part in parts:
        if part not in _PARTS:
            raise UserError("--only", part, f"expected one of {', '.join(_PARTS)}")
    for kind in options.kinds.split(","):
        if kind not in REACTIONS:
            raise UserError("--kinds", kind, f"expected one of {', '.join(REACTIONS)}")
    if not available():
        raise UserError("bench", "hardware", "no network namespace, expected the right to unshare")
    with tempfile.TemporaryDirectory() as place:
        keep = options.keep or Path(place)
        console = Console()
        if "commands" in parts:
            console.print(_commands(options.scenario, keep / "commands"))
        if "dressing" in parts:
            console.print(_dressing(options.scenario, keep / "dressing", options.rate))
        if "soak" in parts:
            console.print(_soak(options.scenario, keep / "soak", options.minutes))
        if "faults" in parts:
            cases = [FaultCase(k, s) for k in options.kinds.split(",") for s in options.seeds]
            results = _faults(cases, options.scenario, keep / "faults", options.json)
            console.print(_fault_table(results))
            return int(any(r["wrong"] for r in results))
    return 0


def _summary(out: Path) -> dict[str, Any]:
    with RunLog.open(out / "run.h5") as log:
        return summarize(log, wall_time=0.0)


def _commands(scenario: str, out: Path) -> Table:
    play(Plan(scenario, str(out), [*_COARSE, "duration=30"]))
    s = _summary(out / "run")
    table = Table("commands, at full rate", "asked", "reached", title="coarse garment, 30 s")
    latency = s["command_latency_ms"]
    table.add_row("rate, Hz", "200 ± 2 %", f"{s['command_rate_hz']:.1f}")
    table.add_row("status to command, median, ms", "≤ 10", f"{latency['median']:.1f}")
    table.add_row("status to command, 99 %, ms", "≤ 25", f"{latency['p99']:.1f}")
    table.add_row("start-up to first command, s", "≤ 10", f"{s['start_up_s']:.1f}")
    return table


def _dressing(scenario: str, out: Path, rate: float) -> Table:
    done = play(Plan(scenario, str(out), rate=rate, timeout=1200.0))
    run, lab = _summary(out / "run"), _summary(out / "lab")
    table = Table("dressing in two processes", "run", "lab", title=f"rate {rate:g}")
    table.add_row("exit status", str(done.run_status), str(done.lab_status))
    table.add_row("reason", str(run["reason"] or "on"), str(lab["reason"] or "on"))
    table.add_row("dressed in, s", _text(run["dressing_time_s"]), _text(lab["dressing_time_s"]))
    table.add_row(
        "gripper force, N", _text(run["max_gripper_force_N"]), _text(lab["max_gripper_force_N"])
    )
    table.add_row("commands, Hz of this machine's clock", _text(run["command_rate_hz"]), "")
    for name in ("median", "p99"):
        table.add_row(f"latency, {name}, ms", _text(run["command_latency_ms"][name]), "")
    return table


def _soak(scenario: str, out: Path, minutes: float) -> Table:
    # nothing is to succeed, or the run would end
    duration = 60.0 * minutes
    done = play(
        Plan(
            scenario,
            str(out),
            [*_COARSE, "plant.spacing=0.05", "controller.spacing=0.06", f"duration={duration}"],
            timeout=duration + 120.0,
            sampled=True,
        )
    )
    table = Table("memory of its own", "first, MB", "last, MB", "growth, MB/h", "bound, MB/week")
    for name, memory in (("run", done.run_memory), ("lab", done.lab_memory)):
        values = np.array([m for m in memory if np.isfinite(m) and m > 0.0])
        # what is loaded and compiled comes first
        settled = values[len(values) // 4 : -5]
        hours = np.arange(len(settled)) / 3600.0
        slope, _ = np.polyfit(hours, settled, 1)
        rest = settled - np.polyval(np.polyfit(hours, settled, 1), hours)
        error = rest.std() / np.sqrt(len(settled)) / max(hours.std(), 1e-9)
        bound = 168.0 * (slope + 2.0 * error)
        table.add_row(name, *(f"{x:.1f}" for x in (settled[0], settled[-1], slope, bound)))
    return table


def _faults(
    cases: Sequence[FaultCase], scenario: str, out: Path, keep: Path | None
) -> list[dict[str, Any]]:
    known = read_results(keep, name_of, "hardware") if keep is not None else {}
    results = []
    for case in track(cases, "faults", console=Console(stderr=True)):
        name = name_of(vars(case))
        if name not in known:
            known[name] = run_case(case, scenario, out / name)
            if keep is not None:
                write_results(keep, known)
        results.append(known[name])
        if not sys.stderr.isatty():
            r = known[name]
            print(f"{name} {r['source']} at {r['start']:.2f} s: {r['wrong'] or 'as stated'}")
    return results


def _fault_table(results: Sequence[dict[str, Any]]) -> Table:
    table = Table(
        "fault", "as stated", "held within, s", "longest, s", "speed", "torque", title="faults"
    )
    for kind, stated in REACTIONS.items():
        of_kind = [r for r in results if r["case"]["kind"] == kind]
        if not of_kind:
            continue
        held = [r["held_after"] for r in of_kind if r["held_after"] is not None]
        table.add_row(
            kind,
            f"{sum(not r['wrong'] for r in of_kind)} of {len(of_kind)}",
            "" if stated.within is None else f"{stated.within:g}",
            "" if stated.within is None or not held else f"{max(held):.2f}",
            f"{max(r['speed'] for r in of_kind):.2f}",
            f"{max(r['torque'] for r in of_kind):.2f}",
        )
    return table


def _text(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"


if __name__ == "__main__":
    sys.exit(main())
