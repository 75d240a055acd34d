"""Dresses drawn bodies in drawn coats, and compares what becomes of them with the look's verdicts.

    drake-dress bench fit --root 1 --json out/fit.json

Every cut meets every body, in a size from one below to two above the person's own. The look
(`drake-dress garment`) judges all pairs. Then runs are drawn from those that it calls fitting, also
if tight, and from those that it calls too tight. Every run is a separate `drake-dress run` whose
seed draws pose, fabric and start. Gowns are left out, since the look judges coats that open in
front. Results are kept in the file of `--json`, verdicts beside it, and nothing is done again.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial

from benchmarks.fit.drawing import POSTURES, VARIATIONS, Case, pairs, run
from benchmarks.fit.looks import FITTING, TOO_TIGHT, Looks, all_looks, chosen, looks_file
from benchmarks.fit.tables import figures, tables, told
from benchmarks.parser import OneLineParser, at_least_one, exit_with, seed_number
from benchmarks.seeds import root_of
from benchmarks.study import Study, add_study_options, carry_out, exit_status
from drake_dress.errors import UserError
from drake_dress.seeds import PURPOSES, drawn_seeds

_NAME = "fit"


def main(arguments: Sequence[str] | None = None) -> int:
    """Does the missing looks and runs, prints tables.

    Returns:
        0, 1 if a run gave no result, 2 on bad arguments, 130 after Ctrl-C.
    """
    options = _parser().parse_args(arguments)
    _check(options)
    root = root_of(options)
    seeds = drawn_seeds(options.purpose, max(options.cuts, options.bodies), root)
    cuts, bodies = seeds[: options.cuts], seeds[: options.bodies]
    all_pairs = pairs(cuts, bodies, options.posture, options.variation)
    file = None if options.json is None else looks_file(options.json)
    looks, stop = all_looks(all_pairs, file)
    if stop.is_set():
        return stop.status
    cases = chosen(all_pairs, looks, options.fitting, options.tight, root)[: options.limit]
    study = Study(_NAME, Case, run, partial(tables, looks=looks), partial(figures, looks=looks))
    said = (
        f"{options.cuts} cuts and {options.bodies} bodies, drawn with `--purpose "
        f"{options.purpose} --root {root}`, {options.posture}, variation {options.variation}. "
        f"{told(looks)} "
        f"{_drawn(cases, looks)}"
    )
    return exit_status(*carry_out(options, study, cases, said))


def _check(options: argparse.Namespace) -> None:
    most = len(PURPOSES[options.purpose])
    for name in ("cuts", "bodies"):
        count = getattr(options, name)
        if count > most:
            message = f"is {count}, expected at most {most} to {options.purpose}"
            raise UserError("bench", f"--{name}", message)


def _drawn(cases: Sequence[Case], looks: Looks) -> str:
    called = [looks[case.name]["called"] for case in cases]
    fitting = sum(word in FITTING for word in called)
    return f"Drawn to run: {fitting} that fit or are tight, {called.count(TOO_TIGHT)} too tight."


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog=f"drake-dress bench {_NAME}",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    for name, default, text in (
        ("cuts", 30, "drawn cuts"),
        ("bodies", 10, "drawn bodies"),
        ("fitting", 200, "largest number of runs with coats that the look calls fitting"),
        ("tight", 40, "largest number of runs with coats that it calls too tight"),
    ):
        parser.add_argument(
            f"--{name}", type=at_least_one, default=default, metavar="N", help=f"{text}; {default}"
        )
    parser.add_argument("--posture", choices=tuple(POSTURES), default="standing")
    parser.add_argument(
        "--variation",
        choices=tuple(VARIATIONS),
        default="few",
        help="what a run's seed draws besides: pose, fabric and start (few), or nothing",
    )
    parser.add_argument(
        "--purpose",
        choices=tuple(PURPOSES),
        default="report",
        help="seeds of cuts and bodies: to develop (0-99), choose (100-999) or report (1000 and "
        "above, default)",
    )
    parser.add_argument("--root", type=seed_number, help="of the draw; a new one by default")
    parser.add_argument(
        "--limit", type=at_least_one, metavar="N", help="only the first N of the runs"
    )
    add_study_options(parser, _NAME)
    return parser


if __name__ == "__main__":
    exit_with(main)
