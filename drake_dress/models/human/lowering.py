"""Arms that are lowered once both sleeves are on, around a chair that is in the way."""

from __future__ import annotations

import math
from collections.abc import Callable
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


# An arm that has to go around something is lifted by `_OUT` of the way down, and sinks again from
# `_IN` on; meanwhile it comes forward.
_OUT, _IN = 0.3, 0.6
# Lifts that are tried, rad, samples of a way, and the room that an arm keeps, m.
_LIFTS = np.deg2rad(np.arange(0.0, 71.0, 10.0))
_SAMPLES = 21
_ROOM = 0.03


def lowered(
    set_point: FloatArray,
    rate: FloatArray,
    pose: FloatArray,
    share: float,
    share_rate: float,
    lift: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Returns the set-point of arms on their way down, and its rate; both (…,4), rad, rad/s.

    With w = 3 share² − 2 share³, it is (1 − w) times the set-point that the arms would have
    otherwise plus w times the pose, so that it begins and ends smoothly. With a share of 0 it is
    the given set-point to the last bit. An arm with a lift is raised sideways first, comes to its
    pose later, and sinks at last.

    Args:
        set_point: (…,4) that the arms would have otherwise, rad.
        rate: (…,4) of it, rad/s.
        pose: (…,4) in the end, rad.
        share: of the way down, 0 to 1.
        share_rate: of the share, 1/s.
        lift: (…,) largest sideways elevation on the way beyond that of set-point and pose, rad;
            none if not given.
    """
    if share <= 0.0 and share_rate <= 0.0:
        return set_point, rate
    soon, soon_slope = _smooth(share, 0.0, 1.0)
    if lift is None:
        return _between(set_point, rate, pose, soon, soon_slope * share_rate)
    late, late_slope = _smooth(share, _OUT, 1.0)
    lifted = lift > 0.0
    w = np.where(lifted, late, soon)[..., None]
    w_rate = np.where(lifted, late_slope, soon_slope)[..., None] * share_rate
    point, point_rate = _between(set_point, rate, pose, w, w_rate)
    up, up_slope = _smooth(share, 0.0, _OUT)
    down, down_slope = _smooth(share, _IN, 1.0)
    point[..., 0] += lift * (up - down)
    point_rate[..., 0] += lift * (up_slope - down_slope) * share_rate
    return point, point_rate


def _between(
    set_point: FloatArray,
    rate: FloatArray,
    pose: FloatArray,
    w: float | FloatArray,
    w_rate: float | FloatArray,
) -> tuple[FloatArray, FloatArray]:
    point: FloatArray = (1.0 - w) * set_point + w * pose
    point_rate: FloatArray = (1.0 - w) * rate + w_rate * (pose - set_point)
    return point, point_rate


def _smooth(share: float, low: float, high: float) -> tuple[float, float]:
    """Returns a smooth step from 0 at `low` to 1 at `high`, and its derivative."""
    t = min(max((share - low) / (high - low), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / (high - low)


def least_lift(
    room: Callable[[FloatArray], FloatArray], start: FloatArray, pose: FloatArray
) -> FloatArray:
    """Returns the least lift (2,), rad, with which each arm keeps clear of a chair on its way.

    It keeps 3 cm, or what it has at the start and in the end if that is less. If no lift does, it
    is the one with the most room.

    Args:
        room: returns the distances (2,), m, of both arms with angles (2,4), rad, from the chair.
        start: (2,4) angles of both arms now, rad.
        pose: (2,4) in the end, rad.
    """
    asked = np.minimum(_ROOM, np.minimum(room(start), room(pose)))
    best, most = np.zeros(2), np.full(2, -np.inf)
    for lift in _LIFTS:
        way = _way(start, pose, np.full(2, lift))
        least = np.min([room(angles) for angles in way], axis=0)
        better = (most < asked - 1e-9) & (least > most)
        best, most = np.where(better, lift, best), np.where(better, least, most)
        if np.all(most >= asked - 1e-9):
            break
    return best


def longer(start: FloatArray, pose: FloatArray, lift: FloatArray) -> float:
    """Returns how many times as long the way down is with the lifts as without, 1 or more.

    Args:
        start: (2,4) angles of both arms now, rad.
        pose: (2,4) in the end, rad.
        lift: (2,) of the arms on the way, rad.
    """

    def length(lifts: FloatArray) -> FloatArray:
        steps = np.diff(_way(start, pose, lifts), axis=0)
        total: FloatArray = np.linalg.norm(steps, axis=2).sum(axis=0)
        return total

    ratio = length(lift) / np.maximum(length(np.zeros(2)), 1e-6)
    return float(np.max(ratio, initial=1.0, where=lift > 0.0))


def _way(start: FloatArray, pose: FloatArray, lift: FloatArray) -> FloatArray:
    """Returns samples (k,2,4), rad, of the way down of arms that begin at rest."""
    zero, shares = np.zeros_like(start), np.linspace(0.0, 1.0, _SAMPLES)
    return np.stack([lowered(start, zero, pose, share, 1.0, lift)[0] for share in shares])


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
