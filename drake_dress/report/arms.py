"""Measures of the arms in a run, computed from the logged joints, not by the controller."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.models.arm.clearance import Capsules, clearance
from drake_dress.models.arm.panda import LIMITS, SHAPE, panda
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray
from drake_dress.models.sides import SIDES, Side
from drake_dress.report.log import RunLog

# Links that may be near the person: the last one and the hand, which hold the garment.
_NEAR_LINKS = 2


@dataclass(frozen=True)
class ArmMeasures:
    """Measures of the arms at T samples, left and right.

    Attributes:
        speed_share: (T,2) largest joint speed since the previous sample, as a share of its limit.
        torque_share: (T,2) likewise for the joint torque; NaN if not logged.
        margin: (T,2) least distance of a joint to its nearest limit since the previous sample, rad;
            negative beyond the limit.
        off: (T,2) gripper tracking error: distance to the commanded position, m.
        apart: (T,) distance between the arms' capsules, m.
        to_person: (T,2) distance of an arm without its last link and hand to the person's
            capsules, m.
        to_chair: (T,2) likewise to the person's wheelchair; infinite without one.
    """

    speed_share: FloatArray
    torque_share: FloatArray
    margin: FloatArray
    off: FloatArray
    apart: FloatArray
    to_person: FloatArray
    to_chair: FloatArray

    @property
    def kept(self) -> BoolArray:
        """(T,) whether all joints were within their limits."""
        torque = np.nan_to_num(self.torque_share)
        inside = (self.speed_share <= 1.0) & (torque <= 1.0) & (self.margin >= 0.0)
        return np.asarray(inside.all(axis=1), dtype=bool)


def arm_poses(log: RunLog, samples: npt.NDArray[np.integer]) -> FloatArray:
    """Returns (k,a,8,4,4) X_WL of base and links of the arms; a = 0 without arms.

    Args:
        log: Log of the run.
        samples: (k,) indices of the samples.
    """
    if "/arm/left/base" not in log.file:
        return np.zeros((len(samples), 0, 8, 4, 4))
    placed = []
    for side in SIDES:
        arm = panda(np.asarray(log.file[f"/arm/{side}/base"]))
        q = np.asarray(log.file[f"/arm/{side}/q"], dtype=np.float64)[samples]
        placed.append(np.stack([arm.links(row)[:-1] for row in np.nan_to_num(q)]))
    return np.stack(placed, axis=1)


def arm_extremes(log: RunLog, side: Side) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Returns (T,7) least and largest joint, rad, and peaks of speed, rad/s, and torque, N·m.

    They cover all steps since the previous sample. Older logs lack them; the sampled values are
    returned instead.
    """

    def read(name: str, instead: str) -> FloatArray:
        group = log.file[f"/arm/{side}"]
        return np.asarray(group[name if name in group else instead], dtype=np.float64)

    return (
        read("q_least", "q"),
        read("q_most", "q"),
        np.abs(read("v_peak", "v")),
        np.abs(read("torque_peak", "torque")),
    )


def measure_arms(log: RunLog) -> ArmMeasures | None:
    """Returns the measures of the arms; None for a log without arms."""
    if "/arm/left/base" not in log.file:
        return None
    count = len(log)
    speed, torque, margin, off, near, chair = np.full((6, count, 2), np.nan)
    apart = np.full(count, np.nan)
    first, second, radius = log.capsules
    arms = [panda(np.asarray(log.file[f"/arm/{side}/base"])) for side in SIDES]
    series = {
        (side, name): np.asarray(log.file[f"/arm/{side}/{name}"], dtype=np.float64)
        for side in SIDES
        for name in ("q", "q_commanded")
    }
    all_of = np.arange(len(SHAPE.link))
    both = _pairs(all_of, all_of)
    farther = np.flatnonzero(SHAPE.link <= arms[0].count - _NEAR_LINKS)
    of_person, of_chair = (
        _pairs(farther, np.flatnonzero(which)) for which in (~log.of_chair, log.of_chair)
    )
    for k, side in enumerate(SIDES):
        least, most, fastest, strongest = arm_extremes(log, side)
        speed[:, k] = (fastest / LIMITS.speed).max(axis=1)
        torque[:, k] = (strongest / LIMITS.torque).max(axis=1)
        margin[:, k] = np.minimum(least - LIMITS.lower, LIMITS.upper - most).min(axis=1)
    for i in range(count):
        placed = []
        for k, side in enumerate(SIDES):
            links = arms[k].links(series[side, "q"][i])
            asked = arms[k].tool_position(series[side, "q_commanded"][i])
            off[i, k] = np.linalg.norm(links[-1, :3, 3] - asked)
            placed.append(SHAPE.placed(links))
            person = Capsules(first[i], second[i], radius)
            near[i, k] = clearance(placed[k], person, of_person).distance.min(initial=np.inf)
            chair[i, k] = clearance(placed[k], person, of_chair).distance.min(initial=np.inf)
        apart[i] = clearance(placed[0], placed[1], both).distance.min()
    return ArmMeasures(speed, torque, margin, off, apart, near, chair)


def _pairs(first: IndexArray, second: IndexArray) -> IndexArray:
    return np.stack([np.repeat(first, len(second)), np.tile(second, len(first))], axis=1)
