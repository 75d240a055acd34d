"""Whether the controller's garment foresees that a second hand goes in.

    python -m benchmarks.entering out/*/run.h5

From moments of runs, one a second, at which one sleeve is on its arm and the other armhole is near
its hand, the controller's garment is led for 2 s by the grippers as the run led them: past arms
that move as they did, and past arms that stay as they were, which is what the controller expects of
them. How often it has the hand in then is held against whether it was; and where the armhole was.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.logged import logged_policy, opened
from benchmarks.prediction import SEEN, Moment, read_run
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.person_model import person_obstacles
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.models.dressing.sight import distance_to_opening
from drake_dress.models.garment.transfer import barycentric_transfer
from drake_dress.report.log import RunLog

# How far is looked ahead, and the time between moments, s.
_AHEAD, _BETWEEN = 2.0, 1.0
# A hand this close to the surface that spans its armhole is one that may go in, m.
_NEAR = 0.12


@dataclass(frozen=True)
class Ahead:
    """A garment 2 s after a moment: is the hand in, where is its armhole, (3,) m."""

    within: bool
    armhole: FloatArray


@dataclass(frozen=True)
class Entry:
    """What came after a moment, and what was foreseen past arms that move and arms that stay."""

    really: Ahead
    moving: Ahead
    staying: Ahead


def main(arguments: Sequence[str] | None = None) -> int:
    """Reads the runs and prints the table; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", type=Path, nargs="+", metavar="run.h5")
    options = parser.parse_args(arguments)
    found: list[Entry] = []
    try:
        for path, log in opened(options.log):
            found += entries(path, log)
    except UserError as error:
        print(f"entering: {error}", file=sys.stderr)
        return 2
    print(table(found).text())
    return 0


def table(found: Sequence[Entry]) -> Table:
    """Returns how often it is foreseen that hands are in, of those that are and those that not."""
    into = [e for e in found if e.really.within]
    out = [e for e in found if not e.really.within]
    rows = []
    for name, of in (
        ("as they moved", attrgetter("moving")),
        ("where they were", attrgetter("staying")),
    ):
        error = [1e3 * float(np.linalg.norm(of(e).armhole - e.really.armhole)) for e in found]
        rows.append(
            [
                name,
                f"{sum(of(e).within for e in into)} of {len(into)}",
                f"{sum(of(e).within for e in out)} of {len(out)}",
                float(np.median(error)) if error else None,
            ]
        )
    header = ["arms", "foreseen in, of hands in", "foreseen in, of others", "armhole off, mm"]
    return Table(f"Second hands, {_AHEAD:g} s ahead", header, rows)


def entries(path: Path, log: RunLog) -> Iterator[Entry]:
    """Yields what came and what was foreseen after each moment of a run."""
    _, policy = logged_policy(log)
    run = read_run(path, 1)
    seen = barycentric_transfer(run.mesh, policy.mesh)
    last = log.time[-1] - _AHEAD - 2.0 * SEEN
    for time in np.arange(_BETWEEN, last, _BETWEEN):
        moment = Moment(run, policy.mesh, seen, log, float(time))
        joints = moment.joints(np.zeros(1))[0]
        x = moment.plant(0.0)
        on = [policy.planner.is_linked(x, joints, side) for side in (0, 1)]
        if sum(on) != 1:
            continue
        side = on.index(False)
        rim = x[policy.planner.armholes[side]]
        if distance_to_opening(rim, joints[3 * side + 2]) < _NEAR:
            yield _entry(moment, policy, side)


def _entry(moment: Moment, policy: DressingPolicy, side: int) -> Entry:
    h = policy.parameters.time_step
    steps = round(_AHEAD / h)
    moved = moment.joints(h * np.arange(steps + 1, dtype=float))
    stayed = np.repeat(moved[:1], steps + 1, axis=0)
    return Entry(
        _ahead(policy, moment.plant(steps * h), moved[-1], side),
        _ahead(policy, _led(moment, policy, moved), moved[-1], side),
        _ahead(policy, _led(moment, policy, stayed), stayed[-1], side),
    )


def _led(moment: Moment, policy: DressingPolicy, joints: FloatArray) -> FloatArray:
    """Returns the controller's garment (n,3), m, led by grippers past arms at joints (N+1,6,3)."""
    cloth, h = policy.controller.cloth, policy.parameters.time_step
    obstacles = person_obstacles(policy.person, joints, h)
    x, v = moment.plant(0.0), moment.velocity()
    times = h * np.arange(len(joints), dtype=float)
    for motion, around in zip(moment.motion(times), obstacles, strict=True):
        x, v, _, _ = cloth.step(x, v, motion, around)
    return x


def _ahead(policy: DressingPolicy, x: FloatArray, joints: FloatArray, side: int) -> Ahead:
    planner = policy.planner
    return Ahead(planner.is_linked(x, joints, side), planner.sleeves(x)[side].p_c)


if __name__ == "__main__":
    sys.exit(main())
