"""Compares the real-time factor of a dressing with an earlier version's, run by run.

    git worktree add ../before COMMIT
    drake-dress bench realtime --before ../before

For each seed the scenario is run by the earlier version, by this one, and by this one with what has
been added since: a parametric body in place of given measures, and with that its round cones. The
runs take turns, so that a machine that slows down slows down all. `--also` sets other keys for the
third run. A short run of each comes first, which compiles kernels and is not counted.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.figures import at_least, write_figures
from benchmarks.kept import seed_range
from benchmarks.parser import bench_parser, exit_with, output_file
from benchmarks.scenario_run import run_scenario
from benchmarks.section import add_into_option, around, write_between
from drake_dress.errors import UserError
from drake_dress.interrupt import caught_interrupt
from drake_dress.report.summary import read_summary

_NAME = "realtime"
_HERE = Path(__file__).parents[2]
_WARM_UP = "duration=2"
# A man about as large as the measures that it stands in place of.
_BODY = "person.body={sex: male, age: 40, height: 1.76, weight: 78}"
# A run of this version may be slower by what two runs of one version differ by.
_ASKED = 0.97


@dataclass(frozen=True)
class Variant:
    """A version of the code and settings of the scenario."""

    name: str
    checkout: Path
    settings: tuple[str, ...]


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs, compares and prints; returns 0, 1 if this version is slower, 2 on bad arguments."""
    options = _parser().parse_args(arguments)
    if options.into is not None:
        around(options.into, _NAME)
    if not (options.before / "drake_dress" / "__main__.py").is_file():
        raise UserError("bench", "--before", f"{options.before} is no checkout of drake_dress")
    variants = (
        Variant("before", options.before.resolve(), ()),
        Variant("now", _HERE, ()),
        Variant("now, with what was added", _HERE, tuple(options.also or [_BODY])),
    )
    with caught_interrupt() as stop:
        for variant in variants:
            _run(variant, options.scenario, options.seeds[0], [_WARM_UP])
        found: dict[str, list[dict[str, Any]]] = {variant.name: [] for variant in variants}
        for seed in options.seeds:
            for variant in variants:
                summary = _run(variant, options.scenario, seed, options.set)
                if stop.is_set():
                    return stop.status
                found[variant.name].append(summary)
                factor = summary["realtime_factor"]
                print(f"seed {seed}, {variant.name}: {factor:.2f}", flush=True)
    factors = {
        name: np.array([summary["realtime_factor"] for summary in summaries])
        for name, summaries in found.items()
    }
    ratios = {name: float(np.median(each / factors["before"])) for name, each in factors.items()}
    rows = [
        [name, len(each), float(np.median(each)), float(each.min()), ratios[name]]
        for name, each in factors.items()
    ]
    header = ["version", "runs", "real-time factor, median", "least", "to before, median of pairs"]
    shown = Table(f"{options.scenario}, seeds {options.seeds[0]} on", header, rows).text()
    print(f"\n{shown}")
    if options.into is not None:
        write_between(options.into, _NAME, shown)
    figures = [
        at_least(f"real-time factor, {variant.name}, to before", ratios[variant.name], "", _ASKED)
        for variant in variants[1:]
    ]
    if options.json is not None:
        write_figures(options.json, figures, list(options.seeds), runs=found)
    return int(not all(figure.met for figure in figures))


def _run(variant: Variant, scenario: str, seed: int, settings: Sequence[str]) -> dict[str, Any]:
    """Returns the summary of a run, as a user would start it."""
    with tempfile.TemporaryDirectory() as folder:
        file = variant.checkout / "scenarios" / f"{scenario}.yaml"
        words = [*variant.settings, *settings]
        out = Path(folder) / "run"
        _, problem = run_scenario(
            file, out, words, seed, report=False, one_process=False, checkout=variant.checkout
        )
        if problem:
            raise UserError("bench", _NAME, f"{variant.name}: {problem}")
        return read_summary(out / "summary.json")


def _parser() -> argparse.ArgumentParser:
    parser = bench_parser(_NAME, __doc__)
    parser.add_argument(
        "--before", type=Path, required=True, metavar="DIR", help="checkout of an earlier version"
    )
    parser.add_argument(
        "--scenario", default="dummy_standing", metavar="NAME", help="that both versions ship"
    )
    parser.add_argument("--seeds", type=seed_range, default=range(5), metavar="A-B")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument(
        "--also",
        action="append",
        metavar="KEY=VALUE",
        help=f"of the third run; by default {_BODY}",
    )
    parser.add_argument("--json", type=output_file, metavar="FILE", help="figures")
    add_into_option(parser, _NAME)
    return parser


if __name__ == "__main__":
    exit_with(main)
