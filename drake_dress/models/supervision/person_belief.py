"""Plausibility of a person estimate: its pose, its motion, and whether it is frozen.

The pose is checked against the described person (`person_pose.py`). The motion is checked against
the last sound message and against one from a fifth of a second earlier, so that steps within the
error of a point cannot add up.

A real tracker has noise: no value stays the same to the last bit. A simulated one may have none,
and a dummy stands still. A point therefore counts as frozen only relative to its own past: once it
changed in `_LIVELY` consecutive messages, it cannot stay the same for `frozen_time`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.supervision.fault import SOUND, Fault, Finding
from drake_dress.models.supervision.person_pose import POINT_NAMES, PoseBounds, impossible_pose

# Consecutive messages in which a point must change before it can count as frozen; and repeats then.
_LIVELY, _REPEATS = 25, 3
# Age of the anchor, against which accumulated motion is checked, s.
_ANCHOR_AGE = 0.2


@dataclass(frozen=True)
class PersonBounds:
    """Limits of a plausible person estimate.

    Attributes:
        pose: limits of each message's pose.
        speed: greatest speed of a point, m/s.
        frozen_time: time for which a lively point may stay the same, s; 0 disables the check.
    """

    pose: PoseBounds
    speed: float = 3.0
    frozen_time: float = 0.5


@dataclass(frozen=True)
class PersonTrack:
    """Memory of the sound messages.

    Attributes:
        stamp: time stamp of the last one, s.
        points: (6,3) of the last one, m.
        anchor_stamp, anchor: the same of a message from about `_ANCHOR_AGE` earlier.
        changes: (6,) consecutive messages in which a point changed, counted until it is lively.
        same: (6,) consecutive messages in which it did not change.
        changed: (6,) time stamp of its last change, s.
    """

    stamp: float
    points: FloatArray
    anchor_stamp: float
    anchor: FloatArray
    changes: IndexArray = field(default_factory=lambda: np.zeros(6, dtype=np.int64))
    same: IndexArray = field(default_factory=lambda: np.zeros(6, dtype=np.int64))
    changed: FloatArray = field(default_factory=lambda: np.full(6, -np.inf))


def judge_person(
    points: FloatArray, stamp: float, track: PersonTrack | None, bounds: PersonBounds
) -> tuple[Finding, PersonTrack | None]:
    """Returns the finding about a message, and the new track.

    Args:
        points: (6,3) finite, m, world.
        stamp: time stamp of the message, s.
        track: None before the first sound message.
        bounds: limits of a plausible estimate.
    """
    told = impossible_pose(points, bounds.pose)
    if told is not None:
        return Finding(Fault.IMPOSSIBLE, told), track
    if track is None or stamp <= track.stamp:
        return SOUND, track or PersonTrack(stamp, points, stamp, points)
    for since, before in ((track.stamp, track.points), (track.anchor_stamp, track.anchor)):
        told = _leap(points, before, stamp - since, bounds)
        if told is not None:
            return Finding(Fault.LEAP, told), track
    track = _remembered(points, stamp, track)
    told = _frozen(stamp, track, bounds.frozen_time)
    return (SOUND if told is None else Finding(Fault.FROZEN, told)), track


def _leap(points: FloatArray, before: FloatArray, time: float, b: PersonBounds) -> str | None:
    moved = np.linalg.norm(points - before, axis=1)
    allowed = 2.0 * b.pose.point_error + b.speed * time
    k = int(np.argmax(moved))
    if moved[k] <= allowed:
        return None
    return (
        f"{POINT_NAMES[k]} moved {moved[k]:.2f} m in {time:.3f} s, expected {allowed:.2f} m at most"
    )


def _remembered(points: FloatArray, stamp: float, track: PersonTrack) -> PersonTrack:
    anchored = (track.anchor_stamp, track.anchor)
    if stamp - track.anchor_stamp >= _ANCHOR_AGE:
        anchored = (stamp, points)
    moved = (points != track.points).any(axis=1)
    lively = track.changes >= _LIVELY
    return PersonTrack(
        stamp,
        points,
        *anchored,
        changes=np.where(lively, track.changes, np.where(moved, track.changes + 1, 0)),
        same=np.where(moved, 0, track.same + 1),
        changed=np.where(moved, stamp, track.changed),
    )


def _frozen(stamp: float, track: PersonTrack, frozen_time: float) -> str | None:
    if frozen_time == 0.0:
        return None
    still = (track.changes >= _LIVELY) & (track.same >= _REPEATS)
    frozen = np.flatnonzero(still & (stamp - track.changed >= frozen_time))
    if not len(frozen):
        return None
    names = "all points" if len(frozen) == 6 else ", ".join(POINT_NAMES[k] for k in frozen)
    return (
        f"{names} the same to the last bit for {stamp - track.changed[frozen].max():.2f} s after "
        f"changing with each message, expected less than {frozen_time:g} s"
    )
