"""Reads garment files of all kinds, made at run time, and compares with what is true of them.

    drake-dress bench files
    drake-dress bench files --seeds 1000-1019 --json files.json

Each kind is drawn with new measures for each seed. A file has to be read as what it is by at most
three keys, or refused for the reason that it has. The garments are level sets of a trunk with
sleeves, cut open; the package's coats are made otherwise.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from benchmarks.cloth.table import Table
from benchmarks.figures import at_most, every, write_figures
from benchmarks.files.cases import CASES
from benchmarks.files.judged import Result, carried_out
from benchmarks.kept import seed_range
from benchmarks.parser import OneLineParser, bench_parser, exit_with, output_file, some_of
from benchmarks.section import add_into_option, around, write_between

_NAME = "files"
_KINDS = {case.__name__: case for case in CASES}


def main(arguments: Sequence[str] | None = None) -> int:
    """Makes and reads the files and prints a table.

    Returns:
        0; 1 if a file was read wrongly, or refused for another reason than its own.
    """
    options = _parser().parse_args(arguments)
    if options.into is not None:
        around(options.into, _NAME)
    results = []
    for name in options.only:
        for seed in options.seeds:
            with tempfile.TemporaryDirectory() as folder:
                results.append(carried_out(_KINDS[name], seed, Path(folder)))
            print(f"{name}, seed {seed}: {results[-1].wrong or 'right'}", flush=True)
    shown = table(results)
    print(shown.text())
    right = sum(not r.wrong for r in results)
    if options.json is not None:
        figures = [
            every("garment files read right or refused for their reason", right, len(results)),
            at_most("garment files that are silently wrong", sum(r.silent for r in results), "", 0),
        ]
        rows = [asdict(r) for r in results]
        write_figures(options.json, figures, list(options.seeds), results=rows)
    if options.into is not None:
        write_between(options.into, _NAME, shown.text())
    return int(right < len(results))


def table(results: Sequence[Result]) -> Table:
    """Returns how many files of each kind became what they had to."""
    rows: list[list[object]] = []
    for name in dict.fromkeys(r.name for r in results):
        some = [r for r in results if r.name == name]
        told = (_KINDS[name].__doc__ or name).strip().rstrip(".")
        rows.append(
            [
                told,
                len(some),
                sum(not r.wrong for r in some),
                sum(r.silent for r in some),
                max(r.seconds for r in some),
            ]
        )
    header = ["file", "drawn", "right", "silently wrong", "longest, s"]
    return Table("Garment files", header, rows)


def _parser() -> OneLineParser:
    parser = bench_parser(_NAME, __doc__)
    parser.add_argument(
        "--seeds", type=seed_range, default=range(1), metavar="A-B", help="default 0-0"
    )
    parser.add_argument(
        "--only",
        type=some_of(tuple(_KINDS)),
        default=list(_KINDS),
        metavar="KIND,…",
        help=", ".join(_KINDS),
    )
    parser.add_argument("--json", type=output_file, metavar="FILE", help="figures and results")
    add_into_option(parser, _NAME)
    return parser


if __name__ == "__main__":
    exit_with(main)
