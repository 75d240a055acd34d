"""Checks the files left by runs that are killed, terminated or out of disk at random times.

    drake-dress bench killed --moments 100 --json killed.json

Each run writes to a directory that contains the files of an earlier run. Whenever it ends, data
written before must be readable, and files of the two runs must not be mixed.

`group` is SIGTERM to all processes of a run at once, as Ctrl-C and `timeout` send signals.
"""

from __future__ import annotations

import argparse
import json
import secrets
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, every
from benchmarks.kept import read_results
from benchmarks.killed.ended_run import Ended, Plan
from benchmarks.killed.verdict import fingerprints, problems
from benchmarks.parser import at_least_one, bench_parser, exit_with, seed_number
from benchmarks.scenario_run import run_scenario
from benchmarks.study import Study, add_study_options, carry_out, exit_status, place_of
from drake_dress.errors import UserError

_NAME = "killed"
_ROOT = Path(__file__).parents[2]
# its seed varies the dressing, so that files of two runs always differ
_SCENARIO = _ROOT / "scenarios" / "dummy_varied.yaml"
# A run of about ten seconds, five of them simulation.
_SETTINGS = [
    "duration=8",
    "plant.spacing=0.05",
    "plant.time_step=0.01",
    "plant.body_time_step=0.01",
    "controller.spacing=0.06",
]
HOW = ("kill", "terminate", "disk_full", "group")


@dataclass(frozen=True)
class Case:
    """A run that is ended by `how` of HOW at a random share of a whole run's duration.

    `seed` and `number`, the index of the case, draw the time.
    """

    number: int
    how: str
    seed: int

    @property
    def name(self) -> str:
        """Name for files and tables."""
        return f"{self.number:03d}-{self.how}-{self.seed}"

    @property
    def share(self) -> float:
        """Share of a whole run's duration at which it is ended."""
        return float(np.random.default_rng([self.seed, self.number]).uniform(0.0, 1.05))


def main(arguments: Sequence[str] | None = None) -> int:
    """Does the missing runs and prints a table.

    Returns:
        0; 1 if something was lost or mixed; 2 on bad arguments; 130 after Ctrl-C.
    """
    options = _parser().parse_args(arguments)
    seed = _kept_seed(options) if options.seed is None else options.seed
    print(f"seed {seed}", flush=True)
    if subprocess.run(["unshare", "-m", "true"], check=False).returncode:
        raise UserError("bench", _NAME, "no mount namespace, expected the right to unshare")
    cases = [Case(k, HOW[k % len(HOW)], seed) for k in range(options.moments)]
    with tempfile.TemporaryDirectory() as folder:

        def ended(case: Case, keep: Path | None, overrides: Sequence[str]) -> dict[str, Any]:
            with place_of(case, keep) as out:
                return _ended(case, Path(folder), out, overrides)

        if not options.kept:
            _whole(Path(folder), tuple(options.set))
        results, stopped = carry_out(
            options, Study(_NAME, Case, ended, _tables, _figures, _tell), cases
        )
    wrong = any(r["summary"]["wrong"] for r in results if "summary" in r)
    return exit_status(results, stopped) or int(wrong)


def _kept_seed(options: argparse.Namespace) -> int:
    """Returns the seed of the kept results if they are only shown; otherwise a new one."""
    if options.kept and options.json is not None:
        for result in read_results(options.json, lambda case: Case(**case).name, _NAME).values():
            return int(result["case"]["seed"])
    return secrets.randbelow(10**6)


@cache
def _whole(folder: Path, overrides: tuple[str, ...]) -> float:
    """Does the earlier run, and returns the duration of an undisturbed run, s."""
    _, problem = run_scenario(_SCENARIO, folder / "earlier", [*_SETTINGS, *overrides], seed=1)
    if problem:
        raise RuntimeError(problem)
    plan = Plan(
        str(_SCENARIO),
        str(folder / "earlier"),
        str(folder / "whole"),
        [*_SETTINGS, *overrides],
        2,
        "",
        0.0,
    )
    return _played(plan).wall


def _ended(case: Case, folder: Path, out: Path, overrides: Sequence[str]) -> dict[str, Any]:
    moment = case.share * _whole(folder, tuple(overrides))
    earlier = folder / "earlier"
    run_seed = 2 + case.number
    plan = Plan(
        str(_SCENARIO),
        str(earlier),
        str(out),
        [*_SETTINGS, *overrides],
        run_seed,
        case.how,
        moment,
    )
    try:
        end = _played(plan)
    except RuntimeError as error:
        return {"case": asdict(case), "problem": str(error)}
    wrong = problems(out, fingerprints(earlier), run_seed, case.how, end)
    left = sorted(fingerprints(out))
    return {
        "case": asdict(case),
        "summary": {
            "moment": moment,
            "status": end.status,
            "told": end.told[0],
            "acted": end.acted is not None,
            "left": left,
            "wrong": wrong,
            "last_words": (end.words.strip().splitlines() or [""])[-1],
        },
    }


def _played(plan: Plan) -> Ended:
    with tempfile.TemporaryDirectory() as place:
        paper, answer = Path(place) / "plan.json", Path(place) / "outcome.json"
        paper.write_text(json.dumps(asdict(plan)), encoding="utf-8")
        command = [sys.executable, "-m", "benchmarks.killed.ended_run", str(paper), str(answer)]
        done = subprocess.run(
            ["unshare", "-m", *command], cwd=_ROOT, capture_output=True, text=True, check=False
        )
        if not answer.exists():
            raise RuntimeError(f"the run could not be played: {done.stderr.strip()[-300:]}")
        return Ended(**json.loads(answer.read_text(encoding="utf-8")))


def _tell(summary: dict[str, Any]) -> str:
    wrong = "; ".join(summary["wrong"])
    return f"at {summary['moment']:.1f} s: {wrong or 'correct'}, left {summary['left']}"


def _tables(results: Sequence[dict[str, Any]]) -> list[Table]:
    rows = []
    for how in HOW:
        of_kind = [r["summary"] for r in results if r["case"]["how"] == how and "summary" in r]
        if of_kind:
            rows.append(
                [
                    how,
                    len(of_kind),
                    sum(s["acted"] for s in of_kind),
                    sum(s["told"] > 0.0 for s in of_kind),
                    sum(not s["wrong"] for s in of_kind),
                ]
            )
    header = [
        "ended by",
        "runs",
        "ended before their end",
        "while simulating",
        "files correct",
    ]
    return [Table("Runs that are ended at random moments", header, rows)]


def _figures(results: Sequence[dict[str, Any]]) -> list[Figure]:
    right = sum(not r["summary"]["wrong"] for r in results)
    return [every("ended runs with correct files", right, len(results))]


def _parser() -> argparse.ArgumentParser:
    parser = bench_parser(_NAME, __doc__)
    parser.add_argument(
        "--moments", type=at_least_one, default=100, metavar="N", help="default 100"
    )
    parser.add_argument(
        "--seed", type=seed_number, metavar="S", help="of the moments; default: a new one, printed"
    )
    add_study_options(parser, _NAME)
    return parser


if __name__ == "__main__":
    exit_with(main)
