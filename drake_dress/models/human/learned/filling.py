"""Fills in joints that were not observed, from those that were and from how the arm was held.

A joint that cloth hides keeps its angles relative to the limb before it: the forearm turns with
the upper arm, and the arm with the trunk. A hidden elbow between a visible shoulder and hand lies
on the circle that the lengths of both limbs leave, as near as possible to where it would be
otherwise.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.human.learned.arm_frame import facing

# Limbs of a joint that was never observed, m: from its parent, in the direction the person faces
# (x forward, y left for the left arm, mirrored for the right).
_UPPER, _FORE = np.array([0.0, 0.05, -0.28]), np.array([0.05, 0.0, -0.26])
_HALF_SHOULDERS = 0.18
_SIDES = (1.0, -1.0)


def filled(joints: FloatArray, first: FloatArray | None = None) -> tuple[FloatArray, BoolArray]:
    """Returns joints (B,T,6,3), m, without gaps, and which of them were observed (B,T,6).

    Before its first observation a joint is filled backward in time, unless `first` tells of it.

    Args:
        joints: (B,T,6,3) shoulder, elbow, hand of left, then right arm, NaN where not observed.
        first: (B,6,3) what is known of joints before the history, m, NaN where nothing is.
    """
    seen: BoolArray = np.all(np.isfinite(joints), axis=3)
    gaps = ~seen.all(axis=(1, 2))
    if not gaps.any():
        return joints, seen
    result = joints.copy()
    result[gaps] = _without_gaps(joints[gaps], seen[gaps], None if first is None else first[gaps])
    return result, seen


def _without_gaps(joints: FloatArray, seen: BoolArray, first: FloatArray | None) -> FloatArray:
    before = _first_poses(joints, seen, first)
    result = np.empty_like(joints)
    for t in range(joints.shape[1]):
        now = joints[:, t].copy()
        gaps = ~seen[:, t].all(axis=1)
        if gaps.any():
            now[gaps] = filled_pose(now[gaps], seen[gaps, t], before[gaps])
        before = result[:, t] = now
    return result


def filled_pose(pose: FloatArray, seen: BoolArray, before: FloatArray) -> FloatArray:
    """Returns a pose (B,6,3), m, without gaps.

    Args:
        pose: (B,6,3), anything where not seen.
        seen: (B,6).
        before: (B,6,3) the pose before, or one that is predicted, without gaps.
    """
    result = np.where(seen[:, :, None], pose, before)
    _fill_shoulders(result, seen, before)
    turned = _turn_between(facing(before), facing(result))
    for arm in (0, 3):
        _fill_arm(result, seen, before, turned, arm)
    return result


def _fill_shoulders(result: FloatArray, seen: BoolArray, before: FloatArray) -> None:
    """Moves hidden shoulders along with the other one."""
    for own, other in ((0, 3), (3, 0)):
        alone = ~seen[:, own] & seen[:, other]
        moved = before[:, own] + result[:, other] - before[:, other]
        result[alone, own] = moved[alone]
    # both hidden: they move along with a visible hand or elbow only as far as the arm is too short,
    # which the next observation corrects


def _fill_arm(
    result: FloatArray, seen: BoolArray, before: FloatArray, turned: FloatArray, arm: int
) -> None:
    """Fills in elbow and hand of the arm whose shoulder is row `arm`."""
    shoulder, elbow, hand = arm, arm + 1, arm + 2
    upper_before = np.einsum("bij,bj->bi", turned, before[:, elbow] - before[:, shoulder])
    fore_before = np.einsum("bij,bj->bi", turned, before[:, hand] - before[:, elbow])
    held = result[:, shoulder] + upper_before
    hidden = ~seen[:, elbow]
    result[hidden, elbow] = held[hidden]
    between = hidden & seen[:, hand]
    if between.any():
        result[between, elbow] = _elbow_between(
            result[between, shoulder],
            result[between, hand],
            held[between],
            _length(upper_before[between]),
            _length(fore_before[between]),
        )
    lost = ~seen[:, hand]
    if lost.any():
        upper = result[lost, elbow] - result[lost, shoulder]
        along = rotated_between(upper_before[lost], upper, fore_before[lost])
        result[lost, hand] = result[lost, elbow] + along


def _elbow_between(
    shoulder: FloatArray, hand: FloatArray, held: FloatArray, upper: FloatArray, fore: FloatArray
) -> FloatArray:
    """Returns elbows (N,3) at lengths (N,1) from shoulders and hands (N,3), near `held` (N,3)."""
    way = hand - shoulder
    apart = np.maximum(_length(way), 1e-6)
    axis = way / apart
    # a hand that is seen beyond reach stretches both limbs alike
    stretched = np.maximum(1.0, apart / (upper + fore))
    upper, fore = stretched * upper, stretched * fore
    reach = np.maximum(apart, np.abs(upper - fore) + 1e-6)
    along = (upper**2 - fore**2 + reach**2) / (2.0 * reach)
    radius = np.sqrt(np.maximum(upper**2 - along**2, 0.0))
    off = held - shoulder
    off = off - (off * axis).sum(axis=1, keepdims=True) * axis
    size = _length(off)
    # a straight arm leaves the side open: the elbow points down
    down = np.array([0.0, 0.0, -1.0]) - axis * -axis[:, 2:]
    off = np.where(size > 1e-6, off, down)
    side = off / np.maximum(_length(off), 1e-9)
    return shoulder + along * axis + radius * side


def rotated_between(start: FloatArray, end: FloatArray, vectors: FloatArray) -> FloatArray:
    """Returns vectors (N,3) turned by the least rotations that take `start` to `end`, (N,3)."""
    a = start / np.maximum(_length(start), 1e-9)
    b = end / np.maximum(_length(end), 1e-9)
    axis = np.cross(a, b)
    cosine = (a * b).sum(axis=1, keepdims=True)
    # opposite directions have no least rotation; the vector then stays
    share = 1.0 / np.maximum(1.0 + cosine, 1e-6)
    inner = np.cross(axis, vectors)
    turned = vectors + inner + share * np.cross(axis, inner)
    return np.where(cosine > -0.999, turned, vectors)


def _turn_between(before: FloatArray, now: FloatArray) -> FloatArray:
    """Returns the rotations (B,3,3) about the vertical between headings (B,2)."""
    c = (before * now).sum(axis=1)
    s = before[:, 0] * now[:, 1] - before[:, 1] * now[:, 0]
    result = np.zeros((len(c), 3, 3))
    result[:, 0, 0] = result[:, 1, 1] = c
    result[:, 1, 0], result[:, 0, 1] = s, -s
    result[:, 2, 2] = 1.0
    return result


def _first_poses(joints: FloatArray, seen: BoolArray, known: FloatArray | None) -> FloatArray:
    """Returns poses (B,6,3), m: what is known, each joint's first observation, or a usual pose."""
    index = np.argmax(seen, axis=1)
    result = np.take_along_axis(joints, index[:, None, :, None], axis=1)[:, 0].copy()
    ever: BoolArray = np.any(seen, axis=1)
    if known is not None:
        told = np.all(np.isfinite(known), axis=2)
        result[told], ever = known[told], ever | told
    result[~ever] = np.nan
    _place_unseen_shoulders(result, ever)
    front = facing(result)
    left = np.stack([-front[:, 1], front[:, 0]], axis=1)
    for arm, sign in zip((0, 3), _SIDES, strict=True):
        for joint, limb in ((arm + 1, _UPPER), (arm + 2, _FORE)):
            flat = limb[0] * front + sign * limb[1] * left
            usual = result[:, joint - 1] + np.column_stack([flat, np.full(len(flat), limb[2])])
            never = ~ever[:, joint]
            result[never, joint] = usual[never]
    return result


def _place_unseen_shoulders(result: FloatArray, ever: BoolArray) -> None:
    """Places shoulders that were never observed, from what was."""
    for arm in (0, 3):
        for child, limb in ((arm + 1, _UPPER), (arm + 2, _UPPER + _FORE)):
            from_child = ~ever[:, arm] & ever[:, child]
            from_child &= ~np.isfinite(result[:, arm]).all(axis=1)
            result[from_child, arm] = result[from_child, child] - limb * [0.0, 0.0, 1.0]
    for own, other, sign in ((0, 3, 1.0), (3, 0, -1.0)):
        gone = ~np.isfinite(result[:, own]).all(axis=1)
        there = gone & np.isfinite(result[:, other]).all(axis=1)
        across = sign * 2.0 * _HALF_SHOULDERS * _leftward(result, other)
        result[there, own] = result[there, other] + across[there]
    nothing = ~np.isfinite(result[:, [0, 3]]).all(axis=(1, 2))
    result[nothing, 0], result[nothing, 3] = (
        [0.0, _HALF_SHOULDERS, 1.4],
        [0.0, -_HALF_SHOULDERS, 1.4],
    )


def _leftward(poses: FloatArray, shoulder: int) -> FloatArray:
    """Returns the person's left (B,3), guessed from one arm: a hand is before the shoulder."""
    out = poses[:, shoulder + 2, :2] - poses[:, shoulder, :2]
    length = np.linalg.norm(out, axis=1)
    sure = np.isfinite(length) & (length > 1e-6)
    front = np.where(sure[:, None], out / np.where(sure, length, 1.0)[:, None], [1.0, 0.0])
    return np.column_stack([-front[:, 1], front[:, 0], np.zeros(len(front))])


def _length(vectors: FloatArray) -> FloatArray:
    return np.linalg.norm(vectors, axis=-1, keepdims=True)
