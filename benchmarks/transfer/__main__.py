"""Dresses with MuJoCo as the world, and compares with the package's own simulation.

    drake-dress bench transfer --draw report:20 --root 44 --json benchmarks/transfer/results.json

Every run is a separate `drake-dress run` of a varied `dummy_standing`; its seed draws pose, body,
coat, fabric and start, as in `bench dressing`. Controllers do not know which world they act on.
Both worlds have the same seeds and the same mesh, and `summary.json` judges both. Results are kept
in the file of `--json` and not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.dressing.cases import COATS, PERSONS, SCENARIOS, settings_of
from benchmarks.dressing.cases import Case as Dressing
from benchmarks.figures import Figure, at_least
from benchmarks.pairs import (
    GROUP_HEADER,
    PAIRS_HEADER,
    by_group,
    dressed,
    dressing_time,
    gripper_force,
    group_row,
    pairs_row,
)
from benchmarks.parser import OneLineParser, exit_with
from benchmarks.seeds import add_seed_options, chosen_seeds
from benchmarks.statistics import wilson
from benchmarks.study import Study, add_choices, add_study_options, carry_out, exit_status, run_case
from drake_dress.models.cloth.mujoco.settings import import_mujoco
from drake_dress.models.sides import SIDES
from drake_dress.report.summary import SuccessRules

_NAME = "transfer"
WORLDS = ("mujoco", "implicit")
# Share of runs that are to dress in MuJoCo's world, %.
_ASKED = 75.0
_HEADER = [
    *GROUP_HEADER,
    "both sleeves on",
    "stay on",
    "penetration, mm",
    "runs too deep",
    "edge strain",
    "real-time factor",
    "wall time, s",
]
_RULES = SuccessRules()


@dataclass(frozen=True)
class Case:
    """One run: a world of `WORLDS`, person and coat of `bench dressing`, and a seed."""

    world: str
    person: str
    coat: str
    seed: int

    @property
    def name(self) -> str:
        """Name for files and tables."""
        return f"{self.world}-{self.person}-{self.coat}-{self.seed}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Does the missing runs, prints tables; returns 0, 2 on bad arguments, 130 after Ctrl-C."""
    options = _parser().parse_args(arguments)
    if "mujoco" in options.worlds and not options.kept:
        import_mujoco()
    seeds, said = chosen_seeds(options)
    chosen = [
        Case(world, options.person, options.coat, seed)
        for seed in seeds
        for world in options.worlds
    ]
    results, stopped = carry_out(options, Study(_NAME, Case, run, tables, figures), chosen, said)
    return exit_status(results, stopped)


def run(case: Case, keep: Path | None, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Executes one run and returns its result.

    Args:
        case: to run.
        keep: folder for its log, report and replay; None to keep none.
        overrides: further KEY=VALUE settings of the scenario.
    """
    of = Dressing("full", case.person, case.coat, case.seed, "all")
    settings = settings_of(
        of, ["plant.fidelity=quick", f"plant.integrator={case.world}", *overrides]
    )
    scenario = SCENARIOS / PERSONS[case.person]
    return run_case(case, scenario, keep, settings, case.seed, gripper_force)


def tables(results: Sequence[dict[str, Any]]) -> list[Table]:
    """Returns the results of each world, pairs of both, and why runs failed."""
    by = by_group(results, "world", WORLDS)
    rows = [[world, *group_row(runs), *_more(runs)] for world, runs in _lists(by)]
    pairs = [pairs_row(by["mujoco"], by["implicit"])] if len(by) == len(WORLDS) else []
    reasons = [
        [world, r["case"]["seed"], r["summary"]["reason"]]
        for world, runs in _lists(by)
        for r in runs
        if r["summary"]["reason"]
    ]
    return [
        Table("Worlds", ["", *_HEADER], rows),
        Table("mujoco beside implicit: the same persons, coats and seeds", PAIRS_HEADER, pairs),
        Table("Runs that did not dress", ["world", "seed", "reason"], reasons),
    ]


def figures(results: Sequence[dict[str, Any]]) -> list[Figure]:
    """Returns success, time, force and speed in each world, beside what is asked."""
    found = []
    for world, runs in _lists(by_group(results, "world", WORLDS)):
        share = 100.0 * dressed(runs) / len(runs)
        name = f"{world}: runs dressed of {len(runs)}"
        asked = world == "mujoco"
        found.append(at_least(name, share, "%", _ASKED) if asked else Figure(name, share, "%"))
        for end, value in zip(("lower", "upper"), wilson(dressed(runs), len(runs)), strict=True):
            found.append(Figure(f"{world}: {end} end of the 90 % interval", 100.0 * value, "%"))
        time = dressing_time(runs)
        if time is not None:
            found.append(Figure(f"{world}: time to dress, median", time, "s"))
        force = float(np.median([r["force_p99"] for r in runs]))
        found.append(Figure(f"{world}: gripper force, 99 %, median", force, "N"))
        found.append(Figure(f"{world}: real-time factor, median", _pace(runs), "1"))
    return found


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(prog=f"drake-dress bench {_NAME}", description=__doc__)
    add_choices(parser, worlds=WORLDS)
    parser.add_argument("--person", choices=tuple(PERSONS), default="dummy")
    parser.add_argument("--coat", choices=tuple(COATS), default="jacket")
    add_seed_options(parser, range(3))
    add_study_options(parser, _NAME)
    return parser


def _lists(
    by: dict[str, dict[int, dict[str, Any]]],
) -> list[tuple[str, list[dict[str, Any]]]]:
    return [(world, list(runs.values())) for world, runs in by.items()]


def _more(runs: Sequence[dict[str, Any]]) -> list[float]:
    """Returns the cells of `_HEADER` after those of `GROUP_HEADER`.

    They are counts of runs with both sleeves on, of those that stay on, the largest penetration,
    mm, the count of runs beyond its limit, the largest strain; median speed and wall time, s.
    """
    summaries = [r["summary"] for r in runs]
    depths = [s["max_penetration_m"] for s in summaries]
    return [
        sum(map(_sleeves_on, summaries)),
        sum(bool(s["stays_on"]) for s in summaries),
        1e3 * max(depths),
        sum(depth > _RULES.max_penetration for depth in depths),
        max(s["max_edge_strain"] for s in summaries),
        _pace(runs),
        float(np.median([s["wall_time_s"] for s in summaries])),
    ]


def _sleeves_on(summary: dict[str, Any]) -> bool:
    """Returns whether both sleeves were on when the coat was laid, or at the end if it was not."""
    return all(
        summary[f"arm_inside_{side}"] and (summary[f"s_dressed_{side}"] or 0.0) >= _RULES.min_s
        for side in SIDES
    )


def _pace(runs: Sequence[dict[str, Any]]) -> float:
    return float(np.median([r["summary"]["realtime_factor"] for r in runs]))


if __name__ == "__main__":
    exit_with(main)
