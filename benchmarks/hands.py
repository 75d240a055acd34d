"""Finds which quantities correlate with a hand entering its armhole soon afterwards.

    python -m benchmarks.hands out/*/run.h5

Successful and failed runs are sampled six times per second, from the first second until a hand is
in: the hand relative to its armhole, the shape of the coat, the position of the arms. For each
quantity the samples are sorted and split into sixths. The tables give the bounds of each sixth and
the share of its samples after which the hand entered within `--within` seconds. First and second
hands are separate, since the coat of a second hand hangs on the other arm. While neither is in, the
hand counts that enters first, or came nearest to it. A quantity over which the share rises from
zero to one half is worth examining; it does not follow that a controller should change it.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.logged import opened
from benchmarks.parser import output_file
from drake_dress.errors import UserError
from drake_dress.file_output import write_text
from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.preparing import distance_aside
from drake_dress.models.dressing.sight import distance_to_opening
from drake_dress.models.dressing.sleeve import SleeveState, loop_orientation, sleeve_state
from drake_dress.models.human.heading import heading
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog

# Sampling period, and time of the first sample, s.
_STEP, _FROM = 1.0 / 6.0, 1.0
# A hand is in if s stays above this value for this time, s.
_IN, _STAYS = 0.02, 0.5
_PARTS = 6
# Distance to the surface spanning the armhole below which a hand touches it, m. Time within which
# it should enter then, which is also the least time between two touches, s.
_TOUCH, _SOON = 0.03, 2.0


@dataclass(frozen=True)
class Moment:
    """A sample of a hand that is not in.

    Attributes:
        run: Path of the run. time: Time, s. side: Side of the hand.
        second: Whether the other hand is in.
        wait: Time until it enters, s; None if it never does.
        touches: Whether it begins to touch the opening.
        values: Name of a quantity, with its unit, to its value.
    """

    run: str
    time: float
    side: str
    second: bool
    wait: float | None
    touches: bool
    values: dict[str, float]


def main(arguments: Sequence[str] | None = None) -> int:
    """Reads the runs and prints the tables; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", type=Path, nargs="+", metavar="run.h5")
    parser.add_argument("--within", type=float, default=3.0, metavar="S", help="default 3")
    parser.add_argument("--json", type=output_file, metavar="FILE", help="keep the moments")
    options = parser.parse_args(arguments)
    found: list[Moment] = []
    try:
        for path, log in opened(options.log):
            found += moments(log, str(path))
    except UserError as error:
        print(f"hands: {error}", file=sys.stderr)
        return 2
    for table in tables(found, options.within):
        print(table.text(), end="\n\n")
    if options.json:
        write_text(options.json, json.dumps([asdict(m) for m in found], indent=1) + "\n")
    return 0


def tables(found: Sequence[Moment], within: float) -> Iterator[Table]:
    """Yields shares by sixths for first and second hands, for all samples and for touches."""
    for second, which in ((False, "First hand"), (True, "Second hand")):
        of = [m for m in found if m.second == second]
        touching = [m for m in of if m.touches]
        if len(of) >= _PARTS:
            yield _shares(f"{which}: goes in within {within:g} s", of, within)
        if len(touching) >= _PARTS:
            yield _shares(f"{which}, where it touches: within {_SOON:g} s", touching, _SOON)


def _shares(title: str, of: Sequence[Moment], within: float) -> Table:
    right = np.array([m.wait is not None and m.wait <= within for m in of])
    title = f"{title}: {int(right.sum())} of {len(of)} moments"
    header = ["", *(f"sixth {k + 1}" for k in range(_PARTS))]
    rows = []
    for name in of[0].values:
        values = np.array([m.values[name] for m in of])
        order = np.argsort(values, kind="stable")
        cells = []
        for part in np.array_split(order, _PARTS):
            low, high = values[part[0]], values[part[-1]]
            cells.append(f"{low:.3g} to {high:.3g}: {100 * float(right[part].mean()):.0f} %")
        rows.append([name, *cells])
    return Table(title, header, rows)


def moments(log: RunLog, run: str) -> list[Moment]:
    """Returns the samples of a run."""
    time = log.time
    s = np.stack([log.dressing[side][:, 0] for side in SIDES], axis=1)
    is_in = [_stays(time, s[:, i] > _IN) for i in (0, 1)]
    signs = [loop_orientation(log, side) for side in SIDES]
    loops = [log.loops[f"{side}_armhole"] for side in SIDES]
    centers = [log.rest_position[loop].mean(axis=0) for loop in loops]
    reach = float(np.linalg.norm(centers[0] - centers[1]))
    touched = [-np.inf, -np.inf]
    found = []
    for t in np.arange(_FROM, time[-1] - _STAYS, _STEP):
        k = int(np.searchsorted(time, t))
        if is_in[0][k] and is_in[1][k]:
            continue
        x, q = log.garment_position(k), log.joint_position[k]
        sleeves = [sleeve_state(x, loops[i], signs[i]) for i in (0, 1)]
        grippers = [log.gripper_position[side][k] for side in SIDES]
        for i, side in enumerate(SIDES):
            if is_in[i][k]:
                continue
            near = distance_to_opening(x[loops[i]], q[3 * i + 2]) < _TOUCH
            begins = bool(near and time[k] - touched[i] > _SOON)
            touched[i] = time[k] if near else touched[i]
            after = np.flatnonzero(is_in[i][k:])
            wait = float(time[k + after[0]] - time[k]) if len(after) else None
            values = quantities(i, q, sleeves, grippers, reach)
            second = bool(is_in[1 - i][k])
            if second:
                values["s of the first sleeve"] = float(s[k, 1 - i])
            found.append(Moment(run, float(time[k]), side, second, wait, begins, values))
    about = _gone_about(found)
    return [m for m in found if m.second or m.side == about]


def _gone_about(found: Sequence[Moment]) -> str:
    """Returns the side of the hand that enters first, or came nearest to it."""
    free = [m for m in found if not m.second]
    if not free:
        return ""
    return min(free, key=lambda m: (np.inf if m.wait is None else m.wait + m.time, _far(m))).side


def _far(moment: Moment) -> float:
    return moment.values["hand to the armhole's centre, cm"]


def quantities(
    i: int,
    joints: FloatArray,
    sleeves: Sequence[SleeveState],
    grippers: Sequence[FloatArray],
    reach: float,
) -> dict[str, float]:
    """Returns the quantities that may matter for a hand.

    Args:
        i: 0 for the left hand, 1 for the right one.
        joints: (6,3) shoulder, elbow, hand of left, then of right, m.
        sleeves: States of the left and the right sleeve.
        grippers: Positions (3,) of the left and the right gripper, m.
        reach: Distance of the armholes at rest, m.
    """
    sleeve, other, hand = sleeves[i], sleeves[1 - i], joints[3 * i + 2]
    forearm = joints[3 * i + 1] - hand
    forearm = forearm / np.linalg.norm(forearm)
    inward = heading(joints).inward(i)
    offset = hand - sleeve.p_c
    hands = float(np.linalg.norm(joints[2] - joints[5]))
    return {
        "hand to the armhole's centre, cm": 100 * float(np.linalg.norm(offset)),
        "hand beside the armhole's normal, cm": 100 * float(distance_aside(offset, sleeve.v_c)),
        "centre beside the forearm's line, cm": 100 * float(distance_aside(offset, forearm)),
        "normal off the forearm, °": _degrees(float(sleeve.v_c @ forearm)),
        "armholes apart, share of rest": float(np.linalg.norm(sleeve.p_c - other.p_c)) / reach,
        "gripper over the other one, cm": 100 * float((grippers[i] - grippers[1 - i])[2]),
        "hands apart, share of armholes at rest": hands / reach,
        "forearm below level, °": 90.0 - _degrees(float(forearm[2])),
        "forearm inward from hand to elbow, °": 90.0 - _degrees(float(forearm @ inward)),
    }


def _degrees(cosine: float) -> float:
    return float(np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _stays(time: FloatArray, holds: np.ndarray) -> np.ndarray:
    """Returns (T,) whether `holds` is true within a period of at least `_STAYS`."""
    stays = np.zeros(len(time), dtype=bool)
    changes = np.flatnonzero(np.diff(holds, prepend=False, append=False))
    for begin, end in changes.reshape(-1, 2):
        stays[begin:end] = time[end - 1] - time[begin] >= _STAYS
    return stays


if __name__ == "__main__":
    sys.exit(main())
