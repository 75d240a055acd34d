"""Measures the hardware path: rate and latency of commands, faults, a dressing, memory.

    drake-dress bench hardware --only commands
    drake-dress bench hardware --only faults --seeds 0-19 --json hardware.json
    drake-dress bench hardware --only beliefs --seeds 0-19 --json hardware.json
    drake-dress bench hardware --only dressing --rate 0.35
    drake-dress bench hardware --only soak --minutes 20

A lab and a run communicate as two processes over LCM multicast, in a network namespace that has
only a loopback device. Results are kept in the file of `--json` and not measured again.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.hardware.faults import BELIEFS, FAULTS, REACTIONS
from benchmarks.hardware.parts import PARTS, Case, Conditions, run
from benchmarks.hardware.tables import figures, tables, tell
from benchmarks.hardware.two_processes import available
from benchmarks.kept import seed_range
from benchmarks.parser import at_least_one, bench_parser, exit_with, number_between, some_of
from benchmarks.study import (
    Study,
    add_choices,
    add_study_options,
    carry_out,
    exit_status,
    place_of,
)
from drake_dress.errors import UserError
from drake_dress.shipped import shipped_scenario

_NAME = "hardware"
SCENARIO = str(shipped_scenario("lab"))


def main(arguments: Sequence[str] | None = None) -> int:
    """Does the missing measurements and prints tables.

    Returns:
        0; 1 if a reaction to a fault was not as stated; 2 on bad arguments; 130 after Ctrl-C.
    """
    options = _parser().parse_args(arguments)
    if not (options.kept or available()):
        raise UserError("bench", _NAME, "no network namespace, expected the right to unshare")
    conditions = Conditions(
        options.scenario,
        options.rate,
        options.fault_rate,
        options.minutes,
        report=options.keep is not None,
    )

    def measured(case: Case, keep: Path | None, overrides: Sequence[str]) -> dict[str, Any]:
        with place_of(case, keep) as out:
            return run(case, conditions, out, overrides)

    chosen = _cases(options.only, options.kinds, options.seeds, options.repeats)
    results, stopped = carry_out(
        options, Study(_NAME, Case, measured, tables, figures, tell), chosen
    )
    status = exit_status(results, stopped)
    return status or int(any(r["summary"].get("wrong") for r in results))


def _cases(
    parts: Sequence[str], kinds: Sequence[str], seeds: Sequence[int], repeats: int
) -> list[Case]:
    """Returns the cases, with faults ordered by seed first.

    Selected kinds apply to "faults" without restriction, and to "beliefs" if they belong to it. If
    none is selected, each part has all of its kinds.
    """
    groups = {
        "faults": kinds or list(FAULTS),
        "beliefs": [kind for kind in kinds or BELIEFS if kind in BELIEFS],
    }
    of_part = {
        "commands": [Case("commands", seed=number) for number in range(repeats)],
        **{
            part: [Case("faults", kind, seed) for seed in seeds for kind in of_group]
            for part, of_group in groups.items()
        },
    }
    chosen = [c for part in PARTS if part in parts for c in of_part.get(part, [Case(part)])]
    # a selected kind may belong to two parts
    return list(dict.fromkeys(chosen))


def _parser() -> argparse.ArgumentParser:
    parser = bench_parser(_NAME, __doc__)
    parser.add_argument(
        "--only",
        type=some_of(PARTS),
        metavar="PART,…",
        default=["commands", "dressing"],
        help=f"{', '.join(PARTS)}; default commands,dressing",
    )
    parser.add_argument("--scenario", default=SCENARIO, help=f"default {SCENARIO}")
    parser.add_argument(
        "--seeds", type=seed_range, default=range(20), metavar="A-B", help="of faults; default 0-19"
    )
    add_choices(parser, kinds=REACTIONS)
    parser.set_defaults(kinds=[])
    parser.add_argument(
        "--repeats",
        type=at_least_one,
        default=5,
        metavar="N",
        help="of the commands, half a minute each; default 5",
    )
    parser.add_argument(
        "--rate",
        type=number_between(0.02, 10.0),
        default=0.35,
        help="of the dressing; default 0.35",
    )
    parser.add_argument(
        "--fault-rate",
        type=number_between(0.02, 10.0),
        default=1.0,
        metavar="RATE",
        help="of the faults; default 1. A lab that does not keep up with it is not judged: "
        "slow machines take 0.5",
    )
    parser.add_argument(
        "--minutes", type=number_between(0.1, 1e4), default=20.0, help="of the soak; default 20"
    )
    # each measurement uses two processes on two cores
    add_study_options(parser, _NAME, jobs=1)
    return parser


if __name__ == "__main__":
    exit_with(main)
