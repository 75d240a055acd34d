"""Tests the program with random bad scenarios, garment files, measured logs and messages.

    drake-dress bench inputs --cases 5000
    drake-dress bench inputs --cases 5000 --seed 7 --only mesh
    drake-dress bench inputs --seed 7 --case 1234

Each case is a changed valid input. An impossible value must be rejected in one line; a different
notation must give the same result. Other inputs may be accepted or rejected, but must never cause a
traceback, a response time above the limit, or a result that does not match the input.
"""

from __future__ import annotations

import argparse
import secrets
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from queue import SimpleQueue

from benchmarks.cloth.table import Table
from benchmarks.figures import every, write_figures
from benchmarks.inputs.measurements import prepare
from benchmarks.inputs.trials import Outcome, Result
from benchmarks.inputs.worker import KINDS, Worker
from benchmarks.parser import (
    at_least_one,
    bench_parser,
    exit_with,
    output_file,
    seed_number,
    some_of,
)
from benchmarks.section import add_into_option, around, write_between
from drake_dress.interrupt import caught_interrupt
from drake_dress.side_by_side import completed

_NAME = "inputs"
# Longest response time, s.
LIMIT = 10.0
_SHOWN = 40  # failures that are printed in full


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the cases and prints a table.

    Returns:
        0; 1 if a case had a wrong outcome; 2 on bad arguments; 128 plus the signal's number after
        an ending signal.
    """
    options = _parser().parse_args(arguments)
    if options.into is not None:
        around(options.into, _NAME)
    seed = secrets.randbelow(10**6) if options.seed is None else options.seed
    kinds = list(options.only)
    chosen = [options.case] if options.case is not None else list(range(options.cases))
    print(f"seed {seed}, {len(chosen)} cases of {', '.join(kinds)}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        base = Path(folder)
        if "measured" in kinds:
            prepare(base)
        results, stopped = _run(seed, chosen, kinds, base, options.jobs)
    shown = table(results, seed).text()
    failures = [r for r in results if r.problem is not None]
    for r in failures[:_SHOWN]:
        print(f"\n{r.index} {r.kind} {r.mutation} ({r.expect}): {r.problem}\n  {r.told.strip()}")
    print(f"\n{shown}\n\n{len(results) - len(failures)} of {len(results)} handled correctly")
    if options.json is not None:
        _write_json(options.json, results, seed)
    if options.into is not None:
        write_between(options.into, _NAME, shown)
    return int(bool(failures)) if stopped is None else stopped


def _run(
    seed: int, chosen: Sequence[int], kinds: Sequence[str], base: Path, jobs: int
) -> tuple[list[Result], int | None]:
    idle: SimpleQueue[Worker] = SimpleQueue()
    workers = [Worker(kinds, base, LIMIT) for _ in range(min(jobs, len(chosen)))]
    for worker in workers:
        idle.put(worker)

    def one(index: int) -> Result:
        worker = idle.get()
        try:
            return worker.run(seed, index, kinds[index % len(kinds)])
        finally:
            idle.put(worker)

    results: list[Result] = []
    with caught_interrupt() as stop:
        for _, result in completed(one, chosen, len(workers), stop):
            results.append(result)
            if len(results) % 100 == 0:
                wrong = sum(r.problem is not None for r in results)
                print(f"{len(results)}/{len(chosen)}, {wrong} handled wrongly", flush=True)
    for worker in workers:
        worker.close()
    return sorted(results, key=lambda r: r.index), stop.status if stop.is_set() else None


def table(results: Sequence[Result], seed: int) -> Table:
    """Returns the number of cases by kind and outcome."""
    rows = []
    for kind in [*KINDS, ""]:
        of_kind = [r for r in results if kind in ("", r.kind)]
        if not of_kind:
            continue
        count = Counter(r.outcome for r in of_kind)
        rows.append(
            [
                kind or "all",
                len(of_kind),
                *(count[outcome] for outcome in Outcome),
                sum((r.problem or "").startswith("accepted") for r in of_kind),
                sum((r.problem or "").startswith("refused") for r in of_kind),
                max(r.seconds for r in of_kind),
                sum(r.problem is None for r in of_kind),
            ]
        )
    header = ["input", "cases", *(str(o) for o in Outcome), "accepted wrongly", "refused wrongly"]
    return Table(f"Drawn inputs, seed {seed}", [*header, "longest, s", "handled correctly"], rows)


def _write_json(path: Path, results: Sequence[Result], seed: int) -> None:
    """Writes counts and failures: what was as it has to be is drawn again by its seed."""
    failures = [asdict(r) for r in results if r.problem is not None]
    shown = table(results, seed)
    right = len(results) - len(failures)
    write_figures(
        path,
        [every("drawn inputs handled correctly", right, len(results))],
        [seed],
        cases=len(results),
        table=[dict(zip(shown.header, row, strict=True)) for row in shown.rows],
        failures=failures,
    )


def _parser() -> argparse.ArgumentParser:
    parser = bench_parser(_NAME, __doc__)
    parser.add_argument("--cases", type=at_least_one, default=300, metavar="N", help="default 300")
    parser.add_argument(
        "--seed",
        type=seed_number,
        metavar="S",
        help="of all that is drawn; default: a new one, printed",
    )
    parser.add_argument("--case", type=int, metavar="K", help="this one alone, of the same seed")
    parser.add_argument(
        "--only", type=some_of(tuple(KINDS)), default=list(KINDS), metavar="KIND,…",
        help=", ".join(KINDS),
    )  # fmt: skip
    parser.add_argument("--jobs", type=at_least_one, default=2, metavar="N", help="default 2")
    parser.add_argument("--json", type=output_file, metavar="FILE", help="counts and failures")
    add_into_option(parser, _NAME)
    return parser


if __name__ == "__main__":
    exit_with(main)
