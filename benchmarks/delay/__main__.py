"""Measures the time that plans take on this machine, and stores it.

    drake-dress bench delay

`controller.global_mpc.delay: measured` uses the stored delay, which 95 % of the solves do not
exceed. Nothing else should run during the measurement.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, write_figures
from benchmarks.parser import bench_parser, exit_with, output_file
from benchmarks.scenario_run import run_scenario
from drake_dress.errors import UserError
from drake_dress.plan_delay import SHARE, keep_plan_delay
from drake_dress.report.log import RunLog

_SCENARIOS = Path(__file__).parents[2] / "scenarios"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a dressing and stores the quantile of its solve times; returns the exit status."""
    options = _parser().parse_args(arguments)
    with tempfile.TemporaryDirectory() as out:
        _, problem = run_scenario(
            options.scenario, Path(out), options.set, report=False, one_process=False
        )
        if problem:
            raise UserError("bench", "delay", problem)
        with RunLog.open(Path(out) / "run.h5") as log:
            solve = log.solve_time("global")
    solve = solve[np.isfinite(solve)]
    try:
        seconds, path = keep_plan_delay(solve)
    except ValueError as error:
        raise UserError("bench", "delay", str(error)) from None
    at = [0.5, SHARE, 0.99]
    row = [len(solve), *(float(1e3 * np.quantile(solve, q)) for q in at)]
    header = ["solves", *(f"{100 * q:g} % within, ms" for q in at)]
    print(Table("Solves of the global controller", header, [row]).text())
    print(f"\nkept: {1e3 * seconds:.0f} ms in {path}")
    if options.json is not None:
        figures = [
            Figure(f"global solve, {100 * q:g} % within", ms, "ms")
            for q, ms in zip(at, row[1:], strict=True)
        ]
        write_figures(options.json, figures, [])
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = bench_parser("delay", __doc__)
    parser.add_argument("--scenario", type=Path, default=_SCENARIOS / "dummy_standing.yaml")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--json", type=output_file, metavar="FILE", help="figures")
    return parser


if __name__ == "__main__":
    exit_with(main)
