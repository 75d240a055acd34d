"""Cuts recordings into sequences of equal length, to learn from."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from drake_dress.errors import UserError
from drake_dress.learning.motion.sequence import PERIOD
from drake_dress.learning.timed_motion import TimedMotion
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.learned.network import FUTURE, HISTORY
from drake_dress.models.human.learned.network import PERIOD as STEP

# Length of a piece, and time between the beginnings of two, s. A window with its future takes
# nearly four seconds, and one that is played faster takes more.
LENGTH, APART = 5.0, 0.5


@dataclass(frozen=True)
class Pieces:
    """n pieces of S samples, `PERIOD` apart, of persons without a garment.

    Attributes:
        joint_position: (n,S,6,3) m.
        sleeve: (n,S,2,6) NaN.
        intent: (n,S,2) 0, since nobody knows.
    """

    joint_position: FloatArray
    sleeve: FloatArray
    intent: IndexArray

    def __len__(self) -> int:
        return len(self.joint_position)

    @classmethod
    def of(cls, motions: Iterable[TimedMotion]) -> Pieces:
        """Returns the pieces of all motions in which both arms are known throughout.

        Raises:
            UserError: there is none.
        """
        assert LENGTH > (HISTORY + FUTURE) * STEP
        ahead = PERIOD * np.arange(round(LENGTH / PERIOD) + 1)
        found = []
        for motion in motions:
            if not len(motion.time):
                continue
            begin, end = float(motion.time[0]), float(motion.time[-1])
            for start in np.arange(begin, end - ahead[-1] + 1e-9, APART):
                joints = motion.joints_at(start + ahead)
                if np.isfinite(joints).all():
                    found.append(joints)
        if not found:
            raise UserError(
                "recordings", "", f"no {LENGTH:g} s in which both arms are known, expected some"
            )
        joints = np.stack(found)
        return cls(
            joints,
            np.full((*joints.shape[:2], 2, 6), np.nan),
            np.zeros((*joints.shape[:2], 2), dtype=np.int64),
        )
