"""`python -m benchmarks.reach LOG…`: tracking error of arms that follow floating grippers.

For each placement of the bases, two arms follow the grippers of logged dressings, in kinematics
only. A placement is good if the tracking error is always small: the controller cannot dress with
positions that the arms do not reach. Logs are `run.h5` of `drake-dress run` with floating grippers.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.logged import logged_scenario, opened
from benchmarks.parser import OneLineParser, exit_with
from drake_dress.diagrams.arms import ArmReachError, set_up_arms
from drake_dress.diagrams.scenario import Scenario
from drake_dress.diagrams.scenario.schema import Arms
from drake_dress.diagrams.sections.station import placement
from drake_dress.errors import UserError
from drake_dress.models.arm.clearance import Capsules
from drake_dress.models.arm.resolved_rate import GripperGoal
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog

_STEP = 0.02


@dataclass(frozen=True)
class Recorded:
    """Grippers and person of a dressing, sampled every `_STEP`.

    Attributes:
        name: Name of the log's folder.
        grippers: (T,2,3) positions, m. velocity: (T,2,3) velocities, m/s.
        first, second: (T,K,3) ends of the person's capsules, m. radius: (K,) radii, m.
        scenario: Scenario of the dressing.
    """

    name: str
    grippers: np.ndarray
    velocity: np.ndarray
    first: np.ndarray
    second: np.ndarray
    radius: np.ndarray
    scenario: Scenario

    def person(self, k: int) -> Capsules:
        """Returns the person's capsules at sample `k`."""
        return Capsules(self.first[k], self.second[k], self.radius)


@dataclass(frozen=True)
class Followed:
    """Result of arms that follow: lag (T,2), m; least distances between arms, to the person, m."""

    lag: np.ndarray
    between: float
    to_person: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Prints a table; returns 0, or 2 on bad arguments."""
    options = _parser().parse_args(arguments)
    placements = [
        Arms("panda", behind, spread, height, tilt)
        for behind, spread, height, tilt in itertools.product(
            options.behind, options.spread, options.height, options.tilt
        )
    ]
    runs = [recorded(path, log) for path, log in opened(options.logs)]
    print(table(runs, placements).text())
    return 0


def recorded(path: Path, log: RunLog) -> Recorded:
    """Returns the resampled grippers and person of a log.

    Raises:
        UserError: The log's grippers are not floating.
    """
    scenario = logged_scenario(log)
    if scenario.station.arms.model != "floating":
        raise UserError(str(path), "station.arms.model", "is panda, expected floating")
    time = np.arange(0.0, log.time[-1], _STEP)

    def at(rows: np.ndarray) -> np.ndarray:
        flat = rows.reshape(len(rows), -1)
        columns = [np.interp(time, log.time, column) for column in flat.T]
        return np.stack(columns, axis=1).reshape(len(time), *rows.shape[1:])

    grippers = at(np.stack([log.gripper_position[side] for side in SIDES], axis=1))
    first, second, radius = log.capsules
    return Recorded(
        path.parent.name,
        grippers,
        np.gradient(grippers, _STEP, axis=0),
        at(first),
        at(second),
        radius,
        scenario,
    )


def follow(run: Recorded, arms: Arms) -> Followed:
    """Simulates arms with a given placement that follow the grippers of a run.

    Args:
        run: Run with the grippers to follow.
        arms: Placement of the arms.

    Raises:
        ArmReachError: The arms do not reach the start of the run.
    """
    stands = placement(arms, run.scenario.person)
    assert stands is not None
    setup = set_up_arms(stands, run.grippers[0], run.person(0))
    pair, q, rate = setup.pair, setup.start, np.zeros_like(setup.start)
    lag = np.zeros((len(run.grippers), 2))
    between = to_person = np.inf
    for k in range(len(run.grippers) - 1):
        left, right = (
            GripperGoal(run.grippers[k + 1, i], run.velocity[k, i], stands.hand) for i in (0, 1)
        )
        found = pair.rates(q, rate, (left, right), _STEP, run.person(k))
        rate = found.rate
        q = q + _STEP * rate
        between = min(between, found.between_arms)
        to_person = min(to_person, float(found.to_person.min()))
        for i, arm in enumerate(pair.arms):
            lag[k + 1, i] = np.linalg.norm(arm.tool_position(q[i]) - run.grippers[k + 1, i])
    return Followed(lag, between, to_person)


def table(runs: Sequence[Recorded], placements: Sequence[Arms]) -> Table:
    """Returns one row per placement: lag over all runs, the worst run, and least distances."""
    rows: list[list[Any]] = []
    for arms in placements:
        name = (
            f"{arms.distance_behind:g} behind, {arms.spread:g} apart, "
            f"{arms.height_offset:+g} high, {arms.tilt_deg:.0f}°"
        )
        try:
            done = [follow(run, arms) for run in runs]
        except ArmReachError as error:
            rows.append([name, None, None, None, str(error).split(":")[-1].strip(), None, None])
            continue
        lags = [1e3 * f.lag for f in done]
        worst = int(np.argmax([lag.max() for lag in lags]))
        over = np.concatenate([lag.max(axis=1) for lag in lags])
        rows.append(
            [
                name,
                float(np.percentile(over, 99)),
                100.0 * float((over > 10.0).mean()),
                float(lags[worst].max()),
                runs[worst].name,
                100.0 * min(f.between for f in done),
                100.0 * min(f.to_person for f in done),
            ]
        )
    return Table(
        "Arms behind floating grippers",
        [
            "bases",
            "99 %, mm",
            "over 10 mm, %",
            "largest, mm",
            "in",
            "arms apart, cm",
            "arm to person, cm",
        ],
        rows,
    )


def _numbers(text: str) -> list[float]:
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} are no numbers such as 0.8,0.85") from None


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog="python -m benchmarks.reach",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("logs", nargs="+", type=Path, metavar="LOG", help="run.h5, floating")
    usual = Arms()
    for option, default, unit in (
        ("behind", usual.distance_behind, "of the bases behind the person, m"),
        ("spread", usual.spread, "between them, m"),
        ("height", usual.height_offset, "of them over the shoulders, m"),
        ("tilt", usual.tilt_deg, "of the hands, degrees"),
    ):
        parser.add_argument(
            f"--{option}",
            type=_numbers,
            default=[default],
            metavar="X,…",
            help=f"{unit}; default {default:g}",
        )
    return parser


if __name__ == "__main__":
    exit_with(main)
