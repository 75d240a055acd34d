"""What the networks see of each step of the history of an arm: motion, pose, sleeves, what is seen.

All lengths are brought to about 1 by fixed scales, so that no scale depends on the data.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.human.learned.arm_frame import ArmFrames, swapped_sides

# Scales, 1/m: of limbs, of motion within the history, of the other arm, of sleeves; s/m of speeds.
_LIMB, _MOTION, _OTHER, _SLEEVE = 3.0, 3.0, 1.5, 3.0
_JOINT_SPEED, _SLEEVE_SPEED = 2.0, 5.0
# Scale, 1/m, of a sleeve's way from the arm's axis; below this distance, m, it has no direction.
_BESIDE, _CLOSE = 20.0, 0.01
# What is farther or faster than this, in scaled units, tells nothing more.
_MOST = 3.0


def _laid_out(widths: Sequence[tuple[str, int]]) -> dict[str, slice]:
    ends = np.cumsum([width for _, width in widths])
    return {
        name: slice(int(end) - width, int(end))
        for (name, width), end in zip(widths, ends, strict=True)
    }


# The columns of a token, by what they tell of an arm.
TOKEN_COLUMNS: Mapping[str, slice] = MappingProxyType(
    _laid_out(
        [
            ("shoulder, motion within the history", 3),
            ("upper arm", 3),
            ("forearm", 3),
            ("other shoulder", 3),
            ("other hand", 3),
            ("speed of the shoulder", 3),
            ("speed of the elbow", 3),
            ("speed of the hand", 3),
            ("speed of the other hand", 3),
            ("hand, motion within the history", 3),
            ("elbow, motion within the history", 3),
            ("joints are seen", 4),
            ("armhole, from the hand", 3),
            ("armhole, direction", 3),
            ("armhole, speed", 3),
            ("armhole, place on the arm", 2),
            ("armhole beside the arm", 3),
            ("armhole leads the arm", 5),
            ("armhole is known", 1),
            ("other armhole, from its hand", 3),
            ("other armhole, speed", 3),
            ("other armhole is known", 1),
        ]
    )
)
TOKEN_SIZE = max(columns.stop for columns in TOKEN_COLUMNS.values())
# Columns of upper arm, forearm, and the way to the other shoulder.
LIMB_COLUMNS = tuple(TOKEN_COLUMNS[name] for name in ("upper arm", "forearm", "other shoulder"))
# Columns that tell of sleeves: from the first one of an armhole on.
SLEEVE_COLUMNS = slice(TOKEN_COLUMNS["armhole, from the hand"].start, TOKEN_SIZE)


@dataclass(frozen=True)
class Windows:
    """Histories of B persons, T samples one period apart, the last one now.

    Attributes:
        joints: (B,T,6,3) shoulder, elbow, hand of left, then right arm, m, without gaps.
        seen: (B,T,6) whether each joint was observed; else it is filled in.
        sleeves: (B,T,2,6) armhole centre, m, and unit direction from cuff to armhole; any finite
            numbers where it is not known.
        sleeves_seen: (B,T,2) whether they are known.
        period: s.
    """

    joints: FloatArray
    seen: BoolArray
    sleeves: FloatArray
    sleeves_seen: BoolArray
    period: float


@dataclass(frozen=True)
class ArmTokens:
    """The tokens of 2B arms, and the frames that they are in.

    Attributes:
        frames: of the arms.
        joints: (2B,T,6,3) in the frames, m, the arm's own joints first.
        tokens: (2B,T,`TOKEN_SIZE`) single precision.
    """

    frames: ArmFrames
    joints: FloatArray
    tokens: FloatArray


def arm_tokens(windows: Windows, turned: FloatArray | None = None) -> ArmTokens:
    """Returns the tokens of all arms, left arms first.

    Args:
        windows: histories.
        turned: (B,) angles by which the frames are turned, rad.
    """
    frames = ArmFrames.of(windows.joints[:, -1], turned)
    joints = frames.joints(windows.joints)
    known = swapped_sides(windows.sleeves_seen.astype(np.float64))
    center = swapped_sides_of_frames(frames.points(windows.sleeves[..., :3]))
    direction = swapped_sides_of_frames(frames.directions(windows.sleeves[..., 3:]))
    seen = np.concatenate([windows.seen, windows.seen[:, :, [3, 4, 5, 0, 1, 2]]])
    shoulder, elbow, hand, other_shoulder, _, other_hand = np.moveaxis(joints, 2, 0)
    own, other = center[:, :, 0], center[:, :, 1]
    period = windows.period
    place = place_on_arm(own, shoulder, elbow, hand)
    velocities = [rates(p, period) for p in (hand, elbow, shoulder)]
    off, moved = own - place.of((hand, elbow, shoulder)), rates(own, period)
    carried = place.of(velocities)
    toward = off / (_CLOSE + place.distance)[..., None]
    along = [(v * toward).sum(axis=-1, keepdims=True) for v in (moved, carried)]
    leading = np.concatenate([moved - carried, *along], axis=2)
    on_own, on_other = known[:, :, :1], known[:, :, 1:]
    lasting = known * np.concatenate([known[:, :1], known[:, :-1]], axis=1)
    parts = {
        "shoulder, motion within the history": _MOTION * shoulder,
        "upper arm": _LIMB * (elbow - shoulder),
        "forearm": _LIMB * (hand - elbow),
        "other shoulder": _OTHER * (other_shoulder - shoulder),
        "other hand": _OTHER * (other_hand - shoulder),
        "speed of the shoulder": _JOINT_SPEED * velocities[2],
        "speed of the elbow": _JOINT_SPEED * velocities[1],
        "speed of the hand": _JOINT_SPEED * velocities[0],
        "speed of the other hand": 0.5 * _JOINT_SPEED * rates(other_hand, period),
        "hand, motion within the history": _MOTION * (hand - hand[:, -1:]),
        "elbow, motion within the history": _MOTION * (elbow - elbow[:, -1:]),
        "joints are seen": seen[:, :, [0, 1, 2, 5]].astype(np.float64),
        "armhole, from the hand": on_own * np.clip(_SLEEVE * (own - hand), -_MOST, _MOST),
        "armhole, direction": on_own * direction[:, :, 0],
        "armhole, speed": lasting[:, :, :1] * np.clip(_SLEEVE_SPEED * moved, -_MOST, _MOST),
        "armhole, place on the arm": on_own
        * np.stack([place.progress, np.minimum(5.0 * place.distance, _MOST)], axis=2),
        # who leads whom: the sleeve beside the arm's axis, and how each moves in that direction
        "armhole beside the arm": on_own * np.clip(_BESIDE * off, -_MOST, _MOST),
        "armhole leads the arm": lasting[:, :, :1]
        * np.clip(_SLEEVE_SPEED * leading, -_MOST, _MOST),
        "armhole is known": on_own,
        "other armhole, from its hand": on_other
        * np.clip(_SLEEVE * (other - other_hand), -_MOST, _MOST),
        "other armhole, speed": lasting[:, :, 1:]
        * np.clip(_SLEEVE_SPEED * rates(other, period), -_MOST, _MOST),
        "other armhole is known": on_other,
    }
    tokens = np.concatenate([parts[name] for name in TOKEN_COLUMNS], axis=2).astype(np.float32)
    return ArmTokens(frames, joints, np.clip(tokens, -2.0 * _MOST, 2.0 * _MOST))


def swapped_sides_of_frames(pairs: FloatArray) -> FloatArray:
    """Returns (2B,T,2,…) of left and right in frames as each arm's own and the other's."""
    half = len(pairs) // 2
    return np.concatenate([pairs[:half], pairs[half:, :, ::-1]])


def rates(points: FloatArray, period: float) -> FloatArray:
    """Returns the velocities (N,T,3), m/s, between samples; 0 at the first."""
    moved = np.zeros_like(points)
    moved[:, 1:] = np.diff(points, axis=1) / period
    return moved


class PlaceOnArm(NamedTuple):
    """Where points are nearest on arms.

    Attributes:
        progress: (…) 0 hand, 1 elbow, 2 shoulder.
        distance: (…) from the arm, m.
    """

    progress: FloatArray
    distance: FloatArray

    def of(self, joints: Sequence[FloatArray]) -> FloatArray:
        """Returns (…,3) at these places what is given (…,3) at hand, elbow and shoulder."""
        hand, elbow, shoulder = joints
        lower = np.clip(self.progress, 0.0, 1.0)[..., None]
        upper = np.clip(self.progress - 1.0, 0.0, 1.0)[..., None]
        return hand + lower * (elbow - hand) + upper * (shoulder - elbow)


def place_on_arm(
    points: FloatArray, shoulder: FloatArray, elbow: FloatArray, hand: FloatArray
) -> PlaceOnArm:
    """Returns where points (…,3) are nearest on arms with joints (…,3), m."""
    lower, off_lower = _on_limb(points, hand, elbow)
    upper, off_upper = _on_limb(points, elbow, shoulder)
    nearer = off_lower <= off_upper
    return PlaceOnArm(np.where(nearer, lower, 1.0 + upper), np.where(nearer, off_lower, off_upper))


def _on_limb(
    points: FloatArray, start: FloatArray, end: FloatArray
) -> tuple[FloatArray, FloatArray]:
    way = end - start
    length2 = np.maximum((way * way).sum(axis=-1), 1e-9)
    share = np.clip(((points - start) * way).sum(axis=-1) / length2, 0.0, 1.0)
    return share, np.linalg.norm(points - start - share[..., None] * way, axis=-1)
