"""How often a hand is missed before it is in.

    python -m benchmarks.misses out/*/run.h5

The stages are played again over what the controller saw in each run, as often as it looked, by the
present code. Told is, for first and second hands apart: of those that were missed so often, how
many went in before they were missed once more. What is done about misses belongs where that share
has fallen; done before, it is done to hands that go in without it.
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

# From here on misses are told together.
_MANY = 6


@dataclass(frozen=True)
class Hand:
    """A hand of a run that was gone about.

    Attributes:
        second: whether the other one was in.
        missed: how often it was, before it was in or the run had ended.
        entered: whether it was in.
    """

    second: bool
    missed: int
    entered: bool


@dataclass(frozen=True)
class Look:
    """What a look at garment and person came to: who is in, and how often hands were missed."""

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
    """Returns what each look of the controller of a run came to."""
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
    """Returns the first hand of a run and, if that was in, the second one.

    Where they change places, for the one that was in slipped out, the misses of both count.
    """
    first = next((look for look in course if any(look.linked)), None)
    if first is None:
        return [Hand(False, sum(course[-1].attempts), False)]
    both = next((look for look in course if all(look.linked)), None)
    before = sum(first.attempts)
    missed = sum((both or course[-1]).attempts) - before
    return [Hand(False, before, True), Hand(True, missed, both is not None)]


def table(found: Sequence[Hand]) -> Table:
    """Returns how many went in before the next miss, of those that were missed so often."""
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
