"""Executes a `drake-dress run` in a separate process, for benchmarks that need several."""

from __future__ import annotations

import os
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
    checkout: Path | None = None,
) -> tuple[int, str]:
    """Returns the exit status, and why the run gave no result (empty if it gave one).

    Args:
        scenario: Scenario file.
        out: Output directory.
        overrides: KEY=VALUE settings of the scenario.
        seed: Seed of the run; None for the scenario's own.
        report: Whether to write report and replay in addition to log and summary.
        one_process: Whether to use one process only, which leaves other cores to parallel runs.
        checkout: Version of the code that runs it; None for this one.
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
    environment = None if checkout is None else {**os.environ, "PYTHONPATH": str(checkout)}
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=checkout, env=environment
    )
    if done.returncode in (0, 1):
        return done.returncode, ""
    return done.returncode, f"exit {done.returncode}: {done.stderr.strip().splitlines()[-1:]}"
