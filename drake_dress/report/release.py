"""Whether a coat stays on once the grippers have let go of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import BoolArray
from drake_dress.models.dressing.finish import LAY, RELEASED
from drake_dress.models.garment.nape import find_nape
from drake_dress.models.human.heading import heading
from drake_dress.models.human.neck import distance_to_nape, find_neck, nape
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog
from drake_dress.report.measures import Measures, first_lasting


@dataclass(frozen=True)
class ReleaseRules:
    """Criteria of a coat that stays on.

    Attributes:
        min_s: Least progress s of both sleeves at the end. The centre of an armhole that hangs on
            the shoulder is at 1.7 to 1.9; at 1.5 its upper edge begins to leave the shoulder.
        min_time: Least time from the release to the end, s.
        max_collar_to_neck: Largest distance of the collar from the neck at the end, m.
    """

    min_s: float = 1.5
    min_time: float = 2.8
    max_collar_to_neck: float = 0.05


@dataclass(frozen=True)
class Release:
    """End of a run.

    Attributes:
        held: Number of samples before the coat was laid for the last time; all if it never was.
        opened: First sample after which the grippers are open to the end; None if they are not.
        stays_on: Whether both sleeves are on at the end; None if the grippers never opened.
        reason: Why it does not stay on, in words; None if it does, or was never let go.
        collar_to_neck: Distance of the middle of the collar's back from the nape at the end, m;
            None if there is none.
    """

    held: int
    opened: int | None
    stays_on: bool | None
    reason: str | None
    collar_to_neck: float | None


def judge_release(log: RunLog, m: Measures, rules: ReleaseRules = ReleaseRules()) -> Release:
    """Returns how a run ended.

    Args:
        log: Log of the run.
        m: Its measures.
        rules: Criteria.
    """
    laid = first_lasting(_both(log, LAY))
    opened = first_lasting(_both(log, RELEASED))
    held = len(log) if laid is None else laid
    collar = _collar_to_neck(log)
    if opened is None:
        return Release(held, None, None, None, collar)
    reason = _why_off(log, m, opened, rules)
    return Release(held, opened, reason is None, reason, collar)


def _both(log: RunLog, stage: int) -> BoolArray:
    """Returns (T,) whether both sleeves have reached a stage."""
    both: BoolArray = np.all(log.stage >= stage, axis=1)
    return both


def _why_off(log: RunLog, m: Measures, opened: int, rules: ReleaseRules) -> str | None:
    since = float(log.time[-1] - log.time[opened])
    if since < rules.min_time:
        return f"watched for {since:.1f} s after the release, expected {rules.min_time:g} s"
    for k, side in enumerate(SIDES):
        linking, s = int(m.linking[-1, k]), log.dressing[side][:, 0]
        if abs(linking) != 1:
            return f"{side} sleeve came off after the release: linking number {linking}"
        if not s[-1] >= rules.min_s:
            return f"{side} sleeve slid down after the release: s = {s[-1]:.2f} < {rules.min_s:g}"
    return None


def _collar_to_neck(log: RunLog) -> float | None:
    """Returns the distance of the collar from the nape at the end, m; None if there is none."""
    if not len(log):
        return None
    x, joints = log.garment_position(-1), log.joint_position[-1]
    a, b, radius = (log.capsules[0][-1], log.capsules[1][-1], log.capsules[2])
    collar = find_nape(log.rest_position, log.faces, log.loops)
    neck = find_neck(a, b, 0.5 * (joints[0] + joints[3]))
    if collar is None or neck is None or not (np.isfinite(x).all() and np.isfinite(joints).all()):
        return None
    to = heading(joints)
    if collar.in_front:
        to = to.reversed
    ends = nape(joints, float(log.joint_radius[0]), float(radius[neck, 0]), to)
    return distance_to_nape(collar.at(x), ends)
