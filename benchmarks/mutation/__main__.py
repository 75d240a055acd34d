"""Draws mutants of central modules and counts how many the tests catch.

    drake-dress bench mutation --mutants 200 --seed 1

A mutant is a small change of the program. If the tests still pass, they do not cover the changed
behaviour. Results are kept and not run again with the same seed. Each examined survivor has a line
in survivors.json that says why tests need not catch it, or which test does now.
"""

from __future__ import annotations

import argparse
import json
import secrets
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure
from benchmarks.kept import read_results, write_results
from benchmarks.mutation.modules import MODULES
from benchmarks.mutation.mutants import Mutant, all_mutants, change, draw, mutated
from benchmarks.mutation.trial import CAUGHT, SURVIVED, TIMED_OUT, copied, tried
from benchmarks.parser import (
    at_least_one,
    bench_parser,
    exit_with,
    output_file,
    seed_number,
    some_of,
)
from benchmarks.section import add_into_option, around, write_between
from drake_dress.errors import UserError
from drake_dress.interrupt import caught_interrupt

_NAME = "mutation"
_ROOT = Path(__file__).parents[2]
_SURVIVORS = Path(__file__).with_name("survivors.json")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; returns the exit status."""
    options = _parser().parse_args(arguments)
    if options.into is not None:
        around(options.into, _NAME)
    seed = secrets.randbelow(2**32) if options.seed is None else options.seed
    print(f"seed {seed}", flush=True)
    results = read_results(options.json, lambda case: Mutant(**case).name, "mutation")
    with caught_interrupt() as stop:
        for name in options.modules:
            module = MODULES[name]
            share = -(-options.mutants // len(options.modules))
            known = [m for file in module.files for m in all_mutants(name, file, _ROOT)]
            chosen = draw(known, share, _ROOT, seed)
            todo = [m for m in chosen if m.name not in results]
            print(f"{name}: {len(chosen)} of {len(known)} mutants, {len(todo)} to do", flush=True)
            if not todo:
                continue
            with copied(_ROOT) as copy:
                said, _ = tried(module, copy)
                if said != SURVIVED:
                    raise UserError("bench", f"mutation: {name}", f"its tests, unchanged: {said}")
                for mutant in todo:
                    if stop.is_set():
                        print("interrupted: what was done is kept", file=sys.stderr)
                        return stop.status
                    results[mutant.name] = _result(mutant, copy)
                    write_results(options.json, results)
    told = {m: r for m, r in results.items() if r["case"]["module"] in options.modules}
    write_results(options.json, results, _figures(told))
    _print_results(told)
    print(f"\n{_table(told, seed).text()}")
    if options.into is not None:
        write_between(options.into, _NAME, _table(told, seed).text())
    return 0


def _result(mutant: Mutant, copy: Path) -> dict[str, Any]:
    """Returns the result of the tests on a mutant; restores the copy afterwards."""
    path = copy / mutant.file
    code = mutated(mutant, _ROOT)
    assert code is not None
    original = path.read_text(encoding="utf-8")
    path.write_text(code, encoding="utf-8")
    try:
        said, spent = tried(MODULES[mutant.module], copy)
    finally:
        path.write_text(original, encoding="utf-8")
    lines = change(mutant, code, _ROOT)
    print(f"  {said:<9} {spent:5.0f} s  {mutant.file}  {' | '.join(lines[1:3])}", flush=True)
    return {"case": asdict(mutant), "said": said, "seconds": round(spent, 1), "change": lines}


def _table(results: Mapping[str, dict[str, Any]], seed: int) -> Table:
    rows: list[list[Any]] = []
    for name in MODULES:
        said = [r["said"] for r in results.values() if r["case"]["module"] == name]
        if not said:
            continue
        counts = [said.count(word) for word in (CAUGHT, TIMED_OUT, SURVIVED)]
        noticed = 100.0 * (counts[0] + counts[1]) / len(said)
        rows.append([name, len(said), *counts, noticed])
    whole = [sum(row[k] for row in rows) for k in range(1, 5)]
    if rows:
        rows.append(["all", *whole, 100.0 * (whole[1] + whole[2]) / whole[0]])
    header = ["module", "mutants", CAUGHT, TIMED_OUT, SURVIVED, "noticed, %"]
    return Table(f"Mutants that tests notice, seed {seed}", header, rows)


def _figures(results: Mapping[str, dict[str, Any]]) -> list[Figure]:
    noticed = sum(r["said"] != SURVIVED for r in results.values())
    return [Figure("mutants that tests notice", noticed, f"of {len(results)}")]


def _print_results(results: Mapping[str, dict[str, Any]]) -> None:
    why = json.loads(_SURVIVORS.read_text(encoding="utf-8"))
    for name in sorted(n for n, r in results.items() if r["said"] == SURVIVED):
        print(f"\n{name}\n  " + "\n  ".join(results[name]["change"]))
        print(f"  why: {why.get(name, 'not looked at yet')}")


def _parser() -> argparse.ArgumentParser:
    parser = bench_parser(_NAME, __doc__)
    parser.add_argument("--mutants", type=at_least_one, default=200, help="of all modules together")
    parser.add_argument("--seed", type=seed_number, help="of the draw; a new one by default")
    parser.add_argument(
        "--modules",
        type=some_of(tuple(MODULES)),
        default=list(MODULES),
        metavar="NAME,…",
        help=", ".join(MODULES),
    )
    parser.add_argument(
        "--json",
        type=output_file,
        default=Path("out/mutation.json"),
        help="where results are kept; a study goes on from there",
    )
    add_into_option(parser, _NAME)
    return parser


if __name__ == "__main__":
    exit_with(main)
