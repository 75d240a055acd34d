"""`python -m benchmarks.dressing`: dresses persons in coats by each method, under many seeds.

Every run is a `drake-dress run` of its own, with the pose, the coat's size, the plant's fabric and
the start drawn by the seed. What was run stays in the file of `--json` and is not run again.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.dressing.cases import COATS, METHODS, PERSONS, Case, cases, run
from benchmarks.dressing.tables import figure, tables
from benchmarks.kept import read_results, seed_range
from benchmarks.parser import INTERRUPTED, UNUSABLE, OneLineParser, some_of
from benchmarks.section import END, around, begin, write_between
from benchmarks.study import how_it_ended, run_missing
from drake_dress.discrepancy.results import write_text
from drake_dress.errors import UserError

_NAME = "dressing"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs what is missing and prints tables; returns 0, 2 for bad arguments, 130 after Ctrl-C."""
    options = _parser().parse_args(arguments)
    if options.into:
        around(options.into, _NAME)
    chosen = cases(options.methods, options.persons, options.coats, options.seeds)
    kept = {} if options.json is None else read_results(options.json, _name, _NAME)
    missing = [case for case in chosen if case.name not in kept]
    print(f"{len(chosen)} runs, {len(missing)} of them not run yet", flush=True)
    stopped = not options.kept and run_missing(
        missing,
        kept,
        lambda case: run(case, options.keep, options.set),
        how_it_ended,
        options.jobs,
        options.json,
    )
    results = [kept[case.name] for case in chosen if case.name in kept]
    shown = "\n\n".join(t.text() for t in tables(results) if t.rows)
    print(f"\n{shown}", flush=True)
    if options.into:
        write_between(options.into, _NAME, shown)
    if options.plot:
        write_text(options.plot, figure(results))
    if stopped:
        return INTERRUPTED
    return int(any("problem" in result for result in results))


def _name(case: dict[str, Any]) -> str:
    return Case(**case).name


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(prog="drake-dress bench dressing", description=__doc__)
    for name, known in (("methods", METHODS), ("persons", PERSONS), ("coats", COATS)):
        parser.add_argument(
            f"--{name}",
            type=some_of(tuple(known)),
            default=list(known),
            metavar="NAME,…",
            help=", ".join(known),
        )
    parser.add_argument("--seeds", type=seed_range, default=range(13), metavar="A-B")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="runs side by side")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep logs, reports and replays")
    parser.add_argument("--json", type=Path, metavar="FILE", help="results, resumed from")
    parser.add_argument("--kept", action="store_true", help="run nothing; tables of what is there")
    parser.add_argument(
        "--into",
        type=Path,
        metavar="FILE.md",
        help=f"put the tables between {begin(_NAME)} and {END}",
    )
    parser.add_argument("--plot", type=Path, metavar="FILE", help="s, l and force over time, SVG")
    return parser


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        print(f"drake-dress: {error}", file=sys.stderr)
        sys.exit(UNUSABLE)
