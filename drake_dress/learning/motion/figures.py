"""Figures that describe sequences: how much of them is motion, by will or not, and how fast."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_dress.learning.motion.motion_file import MotionArrays
from drake_dress.learning.motion.sequence import AT_REST, PERIOD, speeds
from drake_dress.models.arrays import FloatArray

_SHOULDERS, _HANDS = [0, 3], [2, 5]
_QUANTILES = 0.5, 0.95


@dataclass(frozen=True)
class Figures:
    """Figures of sequences; pairs are the median and the 95 % quantile.

    Attributes:
        count: number of sequences.
        time: total length, s.
        will: share of the arms' time in which they move by the person's own will.
        rest: share of the hands' time at rest.
        speed: of the hands, m/s, over all times.
        hand_travel: largest distance of a hand from its first place in a sequence, m.
        shoulder_travel: likewise, of a shoulder, m.
        on: share of the arms' time in their sleeves.
    """

    count: int
    time: float
    will: float
    rest: float
    speed: tuple[float, float]
    hand_travel: tuple[float, float]
    shoulder_travel: tuple[float, float]
    on: float


def figures_of(parts: Sequence[MotionArrays]) -> Figures:
    """Returns the figures of all sequences of all parts, which may differ in length."""
    joints = [p.joint_position.astype(np.float64) for p in parts]
    speed = np.concatenate([speeds(j[:, :, _HANDS]).ravel() for j in joints])
    return Figures(
        count=sum(len(p) for p in parts),
        time=PERIOD * sum(len(j) * (j.shape[1] - 1) for j in joints),
        will=float(np.mean(np.concatenate([p.intent.ravel() for p in parts]))),
        rest=float(np.mean(speed < AT_REST)),
        speed=_pair(speed),
        hand_travel=_pair(np.concatenate([_travel(j[:, :, _HANDS]).ravel() for j in joints])),
        shoulder_travel=_pair(
            np.concatenate([_travel(j[:, :, _SHOULDERS]).ravel() for j in joints])
        ),
        on=float(np.mean(np.concatenate([p.on.ravel() for p in parts]))),
    )


def _travel(points: FloatArray) -> FloatArray:
    """Returns the largest distance (n,k), m, of points (n,T,k,3), m, from their first place."""
    travel: FloatArray = np.linalg.norm(points - points[:, :1], axis=-1).max(axis=1)
    return travel


def _pair(values: FloatArray) -> tuple[float, float]:
    median, most = np.quantile(values, _QUANTILES)
    return float(median), float(most)
