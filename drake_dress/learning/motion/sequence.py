"""One sequence: a person who moves for some seconds, in a garment or without one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray

# Kinds of sequences: the person follows the garment; moves by will in it; moves without a garment,
# and with the whole body.
Kind = Literal["passive", "active", "free"]
KINDS: tuple[Kind, ...] = ("passive", "active", "free")
DURATION = 20.0  # s
PERIOD = 0.05  # s, between samples
COUNT = round(DURATION / PERIOD) + 1
AT_REST = 0.02  # m/s, speed of a hand below which it counts as at rest
# A hand that moves within this time of a moment is not at rest then, s: a wave turns around.
_TURNS_AROUND = 0.2


@dataclass(frozen=True)
class Sequence:
    """A sequence of T samples, `PERIOD` apart.

    Attributes:
        joints: (T,6,3) shoulder, elbow, hand of left, then right arm, m, world.
        sleeves: (T,2,6) centre, m, and unit direction from cuff to armhole of left and right
            armhole; NaN without a garment.
        intent: (T,2) 1 where will moves the arm, by itself or with the torso; 0 where it rests, is
            held, or follows. A hand slower than `AT_REST` rests.
        on: (T,2) 1 where the arm is in its sleeve.
    """

    joints: FloatArray
    sleeves: FloatArray
    intent: IndexArray
    on: IndexArray

    @classmethod
    def empty(cls) -> Sequence:
        """Returns a sequence of `COUNT` samples to be filled in."""
        return cls(
            np.empty((COUNT, 6, 3)),
            np.full((COUNT, 2, 6), np.nan),
            np.zeros((COUNT, 2), dtype=np.int64),
            np.zeros((COUNT, 2), dtype=np.int64),
        )


def speeds(points: FloatArray) -> FloatArray:
    """Returns the speeds (…,T-1,k), m/s, of points (…,T,k,3), m, `PERIOD` apart."""
    speed: FloatArray = np.linalg.norm(np.diff(points, axis=-3), axis=-1) / PERIOD
    return speed


def is_moving(hands: FloatArray) -> BoolArray:
    """Returns (T,2) whether each hand, (T,2,3) m, `PERIOD` apart, moves about that time."""
    speed = speeds(hands)
    fast = np.concatenate([speed[:1], np.maximum(speed[1:], speed[:-1]), speed[-1:]]) > AT_REST
    around = round(_TURNS_AROUND / PERIOD)
    padded = np.pad(fast, ((around, around), (0, 0)))
    moving: BoolArray = np.any([padded[k : k + len(fast)] for k in range(2 * around + 1)], axis=0)
    return moving
