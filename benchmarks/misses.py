"""Counts how often a sleeve misses a hand before the hand enters it.

    python -m benchmarks.misses out/*/run.h5

The current code replays the stage logic on the controller's observations of each run, at the
controller's rate. For first and second hands separately, the table gives the share of hands with k
misses that enter before the next miss. Corrective action belongs where that share has fallen;
earlier, it would affect hands that enter without it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.logged import logged_policy, opened
from drake_dress.errors import UserError
from drake_dress.models.dressing.stages import StageState
from drake_dress.report.log import RunLog

# Counts of misses from this one on share a row.
_MANY = 6


@dataclass(frozen=True)
class Hand:
    """A hand that a sleeve approached in a run.

    Attributes:
        second: Whether the other hand was already in.
        missed: Number of misses before it entered or the run ended.
        entered: Whether it entered.
    """

    second: bool
    missed: int
    entered: bool


@dataclass(frozen=True)
class Look:
    """Result of one observation: which arms are in, and the number of misses of each hand."""

    linked: tuple[bool, bool]
    attempts: tuple[int, int]


def main(arguments: Sequence[str] | None = None) -> int:
    """Reads the runs and prints a table; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", type=Path, nargs="+", metavar="run.h5")
    options = parser.parse_args(arguments)
    found: list[Hand] = []
    try:
        for _, log in opened(options.log):
            found += hands(looks(log))
    except UserError as error:
        print(f"misses: {error}", file=sys.stderr)
        return 2
    print(table(found).text())
    return 0


def looks(log: RunLog) -> list[Look]:
    """Returns the result of each observation of the controller in a run."""
    scenario, policy = logged_policy(log)
    garment = log.file["/estimate/garment/position"]
    person = log.file["/estimate/human/joint_position"]
    stages, found = StageState(), []
    for time in np.arange(0.0, log.time[-1], scenario.controller.global_mpc.period):
        k = int(np.searchsorted(log.time, time))
        x, joints = (np.asarray(seen[k], dtype=np.float64) for seen in (garment, person))
        stages, given = policy.planner.assign(stages, x, joints, float(time))
        linked = (given.facts[0].linked, given.facts[1].linked)
        found.append(Look(linked, stages.attempts))
    return found


def hands(course: Sequence[Look]) -> list[Hand]:
    """Returns the first hand of a run and, if it entered, the second one.

    If the first hand slips out and the hands swap roles, the misses of both count.
    """
    first = next((look for look in course if any(look.linked)), None)
    if first is None:
        return [Hand(False, sum(course[-1].attempts), False)]
    both = next((look for look in course if all(look.linked)), None)
    before = sum(first.attempts)
    missed = sum((both or course[-1]).attempts) - before
    return [Hand(False, before, True), Hand(True, missed, both is not None)]


def table(found: Sequence[Hand]) -> Table:
    """Returns, by number of misses, how many hands entered before the next miss."""
    most = max((hand.missed for hand in found), default=0)
    rows = []
    for least in range(_MANY + 1):
        misses = range(least, least + 1) if least < _MANY else range(least, max(least, most) + 1)
        name = str(least) if least < _MANY else f"{least} and more"
        rows.append([name, *(_entered(found, second, misses) for second in (False, True))])
    return Table("In before the next miss", ["missed", "first hands", "second hands"], rows)


def _entered(found: Sequence[Hand], second: bool, misses: range) -> str:
    of = [hand for hand in found if hand.second == second]
    tried = sum(h.missed > k or (h.missed == k and h.entered) for h in of for k in misses)
    entered = sum(h.missed in misses and h.entered for h in of)
    return f"{entered} of {tried}" if tried else "–"


if __name__ == "__main__":
    sys.exit(main())
