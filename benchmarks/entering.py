"""Tests whether the controller's garment predicts that the second hand enters its armhole.

    python -m benchmarks.entering out/*/run.h5

The start times, one per second, are those at which one sleeve is on its arm and the other armhole
is near its hand. From each, the controller's garment is simulated for 2 s with the recorded motion
of the grippers: once with the recorded motion of the arms, and once with arms at rest, which the
controller assumes. The prediction that the hand is in, and the position of the armhole, are
compared with the run.
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
from benchmarks.garment_prediction import SEEN, Moment, read_run
from benchmarks.logged import logged_policy, opened
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.person_model import person_obstacles
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.models.dressing.sight import distance_to_opening
from drake_dress.models.garment.transfer import barycentric_transfer
from drake_dress.report.log import RunLog

# Prediction horizon, and time between start times, s.
_AHEAD, _BETWEEN = 2.0, 1.0
# Distance of a hand to the surface spanning its armhole below which it may enter, m.
_NEAR = 0.12


@dataclass(frozen=True)
class Ahead:
    """A garment 2 s after a start time: whether the hand is in, and the armhole centre (3,), m."""

    within: bool
    armhole: FloatArray


@dataclass(frozen=True)
class Entry:
    """The actual outcome, and the predictions with moving arms and with arms at rest."""

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
    """Returns how often hands are predicted to be in, for hands that are in and that are not."""
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
    """Yields the outcome and the predictions for each start time of a run."""
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
    """Returns the controller's predicted garment (n,3), m, for joints (N+1,6,3) of the person."""
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
