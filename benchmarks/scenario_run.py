"""One `drake-dress run` in a process of its own, for benchmarks that need several."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path


def run_scenario(
    scenario: Path,
    out: Path,
    overrides: Sequence[str] = (),
    seed: int | None = None,
    report: bool = True,
    one_process: bool = True,
) -> tuple[int, str]:
    """Returns the exit status, and why the run could not be used (empty where it could).

    Args:
        scenario: file.
        out: directory that it writes to.
        overrides: KEY=VALUE for the scenario.
        seed: of the run; None for the scenario's own.
        report: whether report and replay are written beside log and summary.
        one_process: whether it leaves other cores to runs beside it.
    """
    command = [sys.executable, "-m", "drake_dress", "run", str(scenario), "--no-meshcat"]
    command += ["--out", str(out)]
    if one_process:
        command.append("--one-process")
    if not report:
        command.append("--no-report")
    if seed is not None:
        command += ["--seed", str(seed)]
    for item in overrides:
        command += ["--set", item]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode in (0, 1):
        return done.returncode, ""
    return done.returncode, f"exit {done.returncode}: {done.stderr.strip().splitlines()[-1:]}"
