"""Whether an estimate of a person can be believed: its pose, its motion, and that it lives.

A pose is held against the person that is described (`person_pose.py`), a motion against the last
sound message and against one of a fifth of a second before, so that steps within the error of a
point cannot add up.

A real tracker has noise: no value stays the same to the last bit. A simulated one may have none,
and a dummy stands still. So a point is judged frozen only against its own past: once it differed
from message to message `_LIVELY` times in a row, it cannot stay the same for `frozen_time`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.supervision.fault import SOUND, Fault, Finding
from drake_dress.models.supervision.person_pose import POINT_NAMES, PoseBounds, impossible_pose

# Messages in a row in which a point changes, before it may be called frozen; and repeats then.
_LIVELY, _REPEATS = 25, 3
# To the anchor, against which accumulated motion is held, s.
_ANCHOR_AGE = 0.2


@dataclass(frozen=True)
class PersonBounds:
    """What an estimate of a person may say.

    Attributes:
        pose: of each message.
        speed: of a point, at most, m/s.
        frozen_time: for which a lively point may stay the same, s; 0 does not judge it.
    """

    pose: PoseBounds
    speed: float = 3.0
    frozen_time: float = 0.5


@dataclass(frozen=True)
class PersonTrack:
    """What is remembered of the sound messages.

    Attributes:
        stamp: of the last one, s.
        points: (6,3) of it, m.
        anchor_stamp, anchor: the same of one from about `_ANCHOR_AGE` before.
        changes: (6,) messages in a row in which a point changed, until it was lively.
        same: (6,) messages in a row in which it did not.
        changed: (6,) stamp at which it changed last, s.
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
    """Returns what is wrong with a message, and what is remembered from then on.

    Args:
        points: (6,3) finite, m, world.
        stamp: of the message, s.
        track: None before the first sound message.
        bounds: of what is believed.
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
