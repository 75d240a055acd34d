"""Dresses active persons with each predictor of the person's motion, and compares them.

    drake-dress bench predictors --draw report:40 --root 7 --json out/predictors.json

Every run is a separate `drake-dress run` at `quick` fidelity. Its seed draws coat, body, pose,
plant and what the person does (docs/prediction.md, whole dressings); all predictors have the same
seeds. Results are kept in the file of `--json` and not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, at_least
from benchmarks.parser import OneLineParser, exit_with
from benchmarks.seeds import add_seed_options, chosen_seeds
from benchmarks.statistics import median_interval, wilson
from benchmarks.study import Study, add_choices, add_study_options, carry_out, exit_status, run_case
from drake_dress.learning.motion.dressings import Dressing
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog

_NAME = "predictors"
PREDICTORS = ("learned", "still", "constant_velocity", "damped_velocity", "ridge", "recurrent")
# Settings of each; a velocity that hardly decays is what is called constant in tables.
_SETTINGS = {
    "learned": ["controller.predictor=learned"],
    "still": ["controller.predictor=still"],
    "constant_velocity": [
        "controller.predictor=constant_velocity",
        "controller.constant_velocity.decay_time=60",
    ],
    "damped_velocity": ["controller.predictor=constant_velocity"],
    "ridge": ["controller.predictor=ridge"],
    "recurrent": ["controller.predictor=recurrent"],
}
_HEADER = ["runs", "dressed", "90 % interval, %", "time to dress, s", "force 99 %, N", "peak, N"]
_BESIDE = [
    "pairs",
    "both dressed",
    "only this",
    "only the other",
    "neither",
    "time less by, s (90 %)",
    "force 99 % less by, N (90 %)",
]


@dataclass(frozen=True)
class Case:
    """One run: a predictor of `PREDICTORS` and a seed."""

    predictor: str
    seed: int

    @property
    def name(self) -> str:
        """Name for files and tables."""
        return f"{self.predictor}-{self.seed}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Does the missing runs, prints tables; returns 0, 2 on bad arguments, 130 after Ctrl-C."""
    options = _parser().parse_args(arguments)
    seeds, said = chosen_seeds(options)
    chosen = [Case(predictor, seed) for seed in seeds for predictor in options.predictors]
    results, stopped = carry_out(options, Study(_NAME, Case, run, tables, figures), chosen, said)
    return exit_status(results, stopped)


def run(case: Case, keep: Path | None, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Executes one run and returns its result.

    Args:
        case: to run.
        keep: folder for its log, report and replay; None to keep none.
        overrides: further KEY=VALUE settings of the scenario.
    """
    of = Dressing(0, "active", case.seed)
    settings = [*of.settings(), *_SETTINGS[case.predictor], *overrides]
    return run_case(case, of.scenario, keep, settings, case.seed, _measured)


def tables(results: Sequence[dict[str, Any]]) -> list[Table]:
    """Returns the results of each predictor, and pairs of the first with each other one."""
    by = _by_predictor(results)
    rows = [[name, *_row(list(mine.values()))] for name, mine in by.items()]
    first = next(iter(by), "")
    beside = [
        [f"{first}, {other}", *_beside(by[first], by[other])] for other in by if other != first
    ]
    return [
        Table("Active persons, by predictor", ["", *_HEADER], rows),
        Table(f"{first} beside others: the same persons, coats and seeds", ["", *_BESIDE], beside),
    ]


def figures(results: Sequence[dict[str, Any]]) -> list[Figure]:
    """Returns what is asked of the learned predictor beside each other one."""
    by = _by_predictor(results)
    found = [
        Figure(f"{name}: runs dressed", _dressed(mine.values()), f"of {len(mine)}")
        for name, mine in by.items()
    ]
    for other in by if "learned" in by else ():
        if other == "learned":
            continue
        pairs = _pairs(by["learned"], by[other])
        more = sum(a["summary"]["success"] - b["summary"]["success"] for a, b in pairs)
        found.append(at_least(f"learned: dressed more than {other}", more, "runs", 0))
        for what, less in (("time", _times(pairs)), ("force", _forces(pairs))):
            low, middle, high = median_interval(less)
            unit = "s" if what == "time" else "N"
            found += [
                Figure(f"learned: {what} less than {other}, median", middle, unit),
                Figure(f"learned: {what} less than {other}, 90 % from", low, unit),
                Figure(f"learned: {what} less than {other}, 90 % to", high, unit),
            ]
    return found


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(prog=f"drake-dress bench {_NAME}", description=__doc__)
    add_choices(parser, predictors=PREDICTORS)
    add_seed_options(parser, range(3))
    add_study_options(parser, _NAME)
    return parser


def _measured(out: Path) -> dict[str, Any]:
    with RunLog.open(out / "run.h5") as log:
        force = [np.linalg.norm(log.gripper_force[side], axis=1) for side in SIDES]
        return {"force_p99": float(np.quantile(np.stack(force), 0.99))}


def _by_predictor(results: Sequence[dict[str, Any]]) -> dict[str, dict[int, dict[str, Any]]]:
    """Returns the finished runs of each predictor by seed."""
    done = [r for r in results if "summary" in r]
    names = [name for name in PREDICTORS if any(r["case"]["predictor"] == name for r in done)]
    return {
        name: {r["case"]["seed"]: r for r in done if r["case"]["predictor"] == name}
        for name in names
    }


def _dressed(results: Any) -> int:
    return sum(bool(r["summary"]["success"]) for r in results)


def _row(results: Sequence[dict[str, Any]]) -> list[Any]:
    dressed = _dressed(results)
    low, high = wilson(dressed, len(results))
    times = [r["summary"]["dressing_time_s"] for r in results if r["summary"]["success"]]
    return [
        len(results),
        dressed,
        f"{100 * low:.0f} to {100 * high:.0f}",
        float(np.median(times)) if times else None,
        float(np.median([r["force_p99"] for r in results])),
        max(r["summary"]["max_gripper_force_N"] for r in results),
    ]


_Pairs = list[tuple[dict[str, Any], dict[str, Any]]]


def _pairs(mine: dict[int, dict[str, Any]], other: dict[int, dict[str, Any]]) -> _Pairs:
    return [(mine[seed], other[seed]) for seed in mine if seed in other]


def _times(pairs: _Pairs) -> list[float]:
    """Returns by how much less time the first took where both dressed, s."""
    return [
        b["summary"]["dressing_time_s"] - a["summary"]["dressing_time_s"]
        for a, b in pairs
        if a["summary"]["success"] and b["summary"]["success"]
    ]


def _forces(pairs: _Pairs) -> list[float]:
    return [b["force_p99"] - a["force_p99"] for a, b in pairs]


def _beside(mine: dict[int, dict[str, Any]], other: dict[int, dict[str, Any]]) -> list[Any]:
    pairs = _pairs(mine, other)
    ended = [(bool(a["summary"]["success"]), bool(b["summary"]["success"])) for a, b in pairs]
    counts = [
        ended.count(how) for how in ((True, True), (True, False), (False, True), (False, False))
    ]
    return [len(pairs), *counts, _shown(_times(pairs)), _shown(_forces(pairs))]


def _shown(values: list[float]) -> str | None:
    if not values:
        return None
    low, middle, high = median_interval(values)
    return f"{middle:.2f} ({low:.2f} to {high:.2f})"


if __name__ == "__main__":
    exit_with(main)
