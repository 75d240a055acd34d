"""Runs one scenario repeatedly and checks whether all logs contain the same numbers.

    drake-dress bench repeat --set duration=12

It runs with and without a load on every core, in one process and in several. Every dataset, except
for measured solve times, is compared bit for bit with the first run's. With `--against RUN.h5` they
are compared with another version's log of the same scenario instead: refactoring must not change
any number. The exit status is 0 if all are equal, 1 if some differ.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py

from benchmarks.cloth.table import Table
from benchmarks.figures import at_most, write_figures
from benchmarks.logged import numbers_that_differ
from benchmarks.parser import bench_parser, exit_with, output_file, output_folder, seed_number
from benchmarks.scenario_run import run_scenario
from benchmarks.section import add_into_option, around, write_between
from drake_dress.errors import UserError
from drake_dress.interrupt import caught_interrupt
from drake_dress.report.log import RunLog

_NAME = "repeat"
_SCENARIOS = Path(__file__).parents[2] / "scenarios"
# Busy processes per core: a run then gets a third of a core.
_LOAD = 2


@dataclass(frozen=True)
class Case:
    """Conditions of a run: one process or several, with or without a full load."""

    name: str
    one_process: bool
    loaded: bool


CASES = (
    Case("one process, alone", True, False),
    Case("several, alone", False, False),
    Case("one process, full load", True, True),
    Case("several, full load", False, True),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs, compares and prints; returns the exit status."""
    options = _parser().parse_args(arguments)
    if options.into is not None:
        around(options.into, _NAME)
    scenario = Path(options.scenario)
    reference = options.against
    if reference is not None:
        with RunLog.open(reference):
            pass
    rows: list[list[Any]] = []
    with caught_interrupt() as stop:
        for number, case in enumerate(CASES):
            out = options.out / str(number)
            with _busy_cores() if case.loaded else contextlib.nullcontext():
                _, problem = run_scenario(
                    scenario, out, options.set, options.seed, False, case.one_process
                )
            if stop.is_set():
                return stop.status
            if problem:
                raise UserError("bench", _NAME, f"{case.name}: {problem}")
            log = out / "run.h5"
            reference = reference or log
            with h5py.File(reference) as first, h5py.File(log) as this:
                count, different = numbers_that_differ(first, this)
                samples = len(this["time"])
            rows.append([case.name, samples, count, len(different), ", ".join(different) or "–"])
            print(f"{case.name}: {count} datasets, {len(different)} differ", flush=True)
    of = "the first run's" if options.against is None else f"those of {options.against.name}"
    header = ["run", "samples", "datasets", f"differ from {of}", "which"]
    shown = Table(f"{scenario.stem}, again", header, rows).text()
    print(f"\n{shown}")
    if options.into is not None:
        write_between(options.into, _NAME, shown)
    if options.json is not None:
        figures = [
            at_most(f"{row[0]}: datasets that differ", row[3], f"of {row[2]}", 0) for row in rows
        ]
        write_figures(options.json, figures, [] if options.seed is None else [options.seed])
    return int(any(row[3] for row in rows))


@contextlib.contextmanager
def _busy_cores() -> Iterator[None]:
    """Keeps every core busy inside the context."""
    context = multiprocessing.get_context("spawn")
    count = _LOAD * (os.cpu_count() or 1)
    busy = [context.Process(target=_turn, daemon=True) for _ in range(count)]
    for process in busy:
        process.start()
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.join()


def _turn() -> None:
    while True:
        pass


def _parser() -> argparse.ArgumentParser:
    parser = bench_parser(_NAME, __doc__)
    parser.add_argument("--scenario", type=Path, default=_SCENARIOS / "dummy_standing.yaml")
    parser.add_argument("--seed", type=seed_number, help="the scenario's own by default")
    parser.add_argument("--out", type=output_folder, default=Path("out/repeat"))
    parser.add_argument(
        "--against",
        type=Path,
        metavar="RUN.h5",
        help="another version's log, compared with instead",
    )
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--json", type=output_file, metavar="FILE", help="figures")
    add_into_option(parser, _NAME)
    return parser


if __name__ == "__main__":
    exit_with(main)
