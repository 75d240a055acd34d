"""Measures how well the coat is tracked with cameras.

    drake-dress bench perception --seeds 0-3 --json out/perception.json

Dressings are recorded whose controllers know the truth, with the cameras of `dummy_cameras` and all
of their errors. Then the coat of each is tracked: with both cameras, with one, and by the
simulation alone. The tracker has another mesh, time step and fabric than the simulated coat; the
person's joints are known to it.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from benchmarks.dressing.cases import PERSONS
from benchmarks.parser import OneLineParser, exit_with
from benchmarks.perception.tables import figures, tables, tell
from benchmarks.perception.tracking import Case, run
from benchmarks.seeds import add_seed_options, chosen_seeds
from benchmarks.study import Study, add_choices, add_study_options, carry_out, exit_status

_NAME = "perception"
_STUDY = Study(_NAME, Case, run, tables, figures, tell)


def main(arguments: Sequence[str] | None = None) -> int:
    """Does the missing runs, prints tables.

    Returns:
        0, 1 if a run gave no result, 2 on bad arguments, 130 after Ctrl-C.
    """
    options = _parser().parse_args(arguments)
    seeds, said = chosen_seeds(options)
    cases = [Case(person, seed) for seed in seeds for person in options.persons]
    return exit_status(*carry_out(options, _STUDY, cases, said))


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog=f"drake-dress bench {_NAME}",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_choices(parser, persons=tuple(PERSONS))
    parser.set_defaults(persons=["dummy"])
    add_seed_options(parser, range(4))
    add_study_options(parser, _NAME, jobs=1)
    return parser


if __name__ == "__main__":
    exit_with(main)
