"""`python -m benchmarks.dressing`: dresses persons in coats by each method, with many seeds.

Every run is a separate `drake-dress run`; its seed draws the pose, the coat's size, the plant's
fabric and the start. Results are kept in the file of `--json` and not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from benchmarks.dressing.cases import COATS, METHODS, PERSONS, STUDIED, VARIATIONS, Case, cases, run
from benchmarks.dressing.drawn import drawn
from benchmarks.dressing.page import study_page
from benchmarks.dressing.parquet import write_table
from benchmarks.dressing.tables import figure, figures, tables
from benchmarks.parser import OneLineParser, exit_with, output_file
from benchmarks.seeds import add_seed_options, chosen_seeds
from benchmarks.study import Study, add_choices, add_study_options, carry_out, exit_status
from drake_dress.file_output import write_text

_NAME = "dressing"


def main(arguments: Sequence[str] | None = None) -> int:
    """Does the missing runs, prints tables; returns 0, 2 on bad arguments, 130 after Ctrl-C."""
    options = _parser().parse_args(arguments)
    seeds, said = chosen_seeds(options)
    chosen = cases(options.methods, options.persons, options.coats, seeds, options.variation)
    results, stopped = carry_out(options, Study(_NAME, Case, run, tables, figures), chosen, said)
    done = [r for r in results if "summary" in r]
    if options.table:
        write_table(options.table, done, drawn)
    if options.page:
        write_text(options.page, study_page(done, drawn, options.page))
    if options.plot:
        write_text(options.plot, figure(results))
    return exit_status(results, stopped)


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(prog="drake-dress bench dressing", description=__doc__)
    add_choices(parser, methods=METHODS, persons=PERSONS, coats=COATS)
    parser.set_defaults(persons=list(STUDIED))
    parser.add_argument(
        "--variation",
        choices=tuple(VARIATIONS),
        default="all",
        help="what seeds draw: all measures, or the few of the first figures",
    )
    add_seed_options(parser, range(13))
    add_study_options(parser, _NAME)
    parser.add_argument(
        "--table", type=output_file, metavar="FILE", help="all runs with what was drawn, Parquet"
    )
    parser.add_argument(
        "--page", type=output_file, metavar="FILE", help="maps of success, and failures, HTML"
    )
    parser.add_argument(
        "--plot", type=output_file, metavar="FILE", help="s, l and force over time, SVG"
    )
    return parser


if __name__ == "__main__":
    exit_with(main)
