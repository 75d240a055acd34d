"""Arms that are lowered once both sleeves are on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.body import ArmPose


@dataclass(frozen=True)
class Lowering:
    """How arms are lowered.

    Attributes:
        pose: of both arms in the end.
        duration: time that it takes, s; 0 keeps the arms where they are.
    """

    pose: ArmPose = ArmPose(
        abduction=math.radians(12.0), extension=math.radians(5.0), elbow_flexion=math.radians(15.0)
    )
    duration: float = 2.5


def lowered(
    set_point: FloatArray, rate: FloatArray, pose: FloatArray, share: float, share_rate: float
) -> tuple[FloatArray, FloatArray]:
    """Returns the set-point of arms on their way down, and its rate; both (…,4), rad, rad/s.

    With w = 3 share² − 2 share³, it is (1 − w) times the set-point that the arms would have
    otherwise plus w times the pose, so that it begins and ends smoothly. With a share of 0 it is
    the given set-point to the last bit.

    Args:
        set_point: (…,4) that the arms would have otherwise, rad.
        rate: (…,4) of it, rad/s.
        pose: (…,4) in the end, rad.
        share: of the way down, 0 to 1.
        share_rate: of the share, 1/s.
    """
    if share <= 0.0 and share_rate <= 0.0:
        return set_point, rate
    w = share * share * (3.0 - 2.0 * share)
    w_rate = 6.0 * share * (1.0 - share) * share_rate
    return (1.0 - w) * set_point + w * pose, (1.0 - w) * rate + w_rate * (pose - set_point)


def next_share(share: float, is_told: bool, duration: float, period: float) -> float:
    """Returns the share of the way down one period later.

    Args:
        share: now.
        is_told: whether the person is told that both sleeves are on. If no longer, the arms come
            up again.
        duration: of the whole way, s.
        period: s.
    """
    step = period / duration if is_told else -period / duration
    return float(np.clip(share + step, 0.0, 1.0))
