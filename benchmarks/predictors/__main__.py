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

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, at_least
from benchmarks.pairs import (
    GROUP_HEADER,
    PAIRS_HEADER,
    by_group,
    dressed,
    forces_less,
    gripper_force,
    group_row,
    pairs_of,
    pairs_row,
    times_less,
)
from benchmarks.parser import OneLineParser, exit_with
from benchmarks.seeds import add_seed_options, chosen_seeds
from benchmarks.statistics import median_interval
from benchmarks.study import Study, add_choices, add_study_options, carry_out, exit_status, run_case
from drake_dress.learning.motion.dressings import Dressing

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
    return run_case(case, of.scenario, keep, settings, case.seed, gripper_force)


def tables(results: Sequence[dict[str, Any]]) -> list[Table]:
    """Returns the results of each predictor, and pairs of the first with each other one."""
    by = _by_predictor(results)
    rows = [[name, *group_row(list(mine.values()))] for name, mine in by.items()]
    first = next(iter(by), "")
    beside = [
        [f"{first}, {other}", *pairs_row(by[first], by[other])] for other in by if other != first
    ]
    return [
        Table("Active persons, by predictor", ["", *GROUP_HEADER], rows),
        Table(
            f"{first} beside others: the same persons, coats and seeds", ["", *PAIRS_HEADER], beside
        ),
    ]


def figures(results: Sequence[dict[str, Any]]) -> list[Figure]:
    """Returns what is asked of the learned predictor beside each other one."""
    by = _by_predictor(results)
    found = [
        Figure(f"{name}: runs dressed", dressed(mine.values()), f"of {len(mine)}")
        for name, mine in by.items()
    ]
    for other in by if "learned" in by else ():
        if other == "learned":
            continue
        pairs = pairs_of(by["learned"], by[other])
        more = sum(a["summary"]["success"] - b["summary"]["success"] for a, b in pairs)
        found.append(at_least(f"learned: dressed more than {other}", more, "runs", 0))
        for what, less in (("time", times_less(pairs)), ("force", forces_less(pairs))):
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


def _by_predictor(results: Sequence[dict[str, Any]]) -> dict[str, dict[int, dict[str, Any]]]:
    return by_group(results, "predictor", PREDICTORS)


if __name__ == "__main__":
    exit_with(main)
