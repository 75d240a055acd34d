"""Makes predicted joints a person's: limbs keep their lengths, joints their limits.

Angles are those of `body.py`, with the trunk upright and facing across the shoulders. A pose that
is beyond a limit already may stay there, but goes no further.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.human.learned.arm_frame import facing
from drake_dress.models.human.prediction import LIMBS, median_of_known

# Lower and upper limits of abduction, extension, rotation, elbow flexion, rad: the ranges of mobile
# adults, since nobody knows the person's own.
LIMITS = np.array([[-1.0, -3.2, -1.9, 0.0], [3.2, 1.4, 1.9, 2.7]])
_MIDDLE = LIMITS.mean(axis=0)
# Ends of the shoulder line and of the limbs.
_PARENTS, _CHILDREN = np.array([(0, 3), *LIMBS]).T
_MIRROR = np.array([1.0, -1.0, 1.0])
# A limit is passed by more than this before a pose is changed, rad: rounding is left alone.
_SLACK = 1e-9


@dataclass(frozen=True)
class Lengths:
    """Lengths (B,) of the shoulder line and (B,4) of left upper arm, forearm, right likewise, m."""

    shoulders: FloatArray
    limbs: FloatArray

    @classmethod
    def of(cls, joints: FloatArray, seen: BoolArray | None = None) -> Lengths:
        """Returns the medians over histories.

        Args:
            joints: (B,T,6,3) m, without gaps.
            seen: (B,T,6) which joints were observed; all if None. What is filled in only counts
                for a limb of which both ends were never seen at once.
        """
        seen = np.ones(joints.shape[:3], dtype=bool) if seen is None else seen
        length = np.linalg.norm(joints[:, :, _CHILDREN] - joints[:, :, _PARENTS], axis=3)
        both = seen[:, :, _CHILDREN] & seen[:, :, _PARENTS]
        both |= ~both.any(axis=1, keepdims=True)
        median = median_of_known(np.where(both, length, np.nan).swapaxes(0, 1))
        return cls(median[:, 0], median[:, 1:])


def person_like(joints: FloatArray, lengths: Lengths, now: FloatArray) -> FloatArray:
    """Returns joints (B,…,6,3), m, with the lengths of the persons, within the joints' limits.

    The middle of the shoulders stays, and each limb keeps its direction unless a limit forbids it.

    Args:
        joints: (B,…,6,3), finite.
        lengths: of the B persons.
        now: (B,6,3) current joints, whose angles are allowed even if beyond a limit.
    """
    shape = joints.shape
    flat = joints.reshape(shape[0], -1, 6, 3)
    extra = (shape[0],) + (1,)
    shoulders = _shoulders(flat, lengths.shoulders.reshape(*extra, 1))
    front = facing(flat.reshape(-1, 6, 3)).reshape(*flat.shape[:2], 2)
    allowed = _allowed(now)
    result = np.empty_like(flat)
    for side, shoulder in enumerate((0, 3)):
        upper = _direction(flat[:, :, shoulder + 1] - flat[:, :, shoulder])
        fore = _direction(flat[:, :, shoulder + 2] - flat[:, :, shoulder + 1])
        upper, fore = _limited(upper, fore, front, side, allowed[:, side])
        size = lengths.limbs[:, 2 * side : 2 * side + 2].reshape(shape[0], 1, 2)
        result[:, :, shoulder] = shoulders[:, :, side]
        result[:, :, shoulder + 1] = result[:, :, shoulder] + size[..., :1] * upper
        result[:, :, shoulder + 2] = result[:, :, shoulder + 1] + size[..., 1:] * fore
    return result.reshape(shape)


def arm_angles_of(upper: FloatArray, fore: FloatArray) -> FloatArray:
    """Returns (2,N,4) both sets of angles, rad, of left arms with unit directions (N,3).

    As `arm_angles`, for many arms: abduction, extension, rotation, elbow flexion.
    """
    x, y, z = np.moveaxis(upper, -1, 0)
    extension = np.arcsin(np.clip(-x, -1.0, 1.0))
    both = []
    for about_x, e in (
        (np.arctan2(y, -z), extension),
        (np.arctan2(-y, z), np.pi - extension),
    ):
        c, s, ce, se = np.cos(about_x), np.sin(about_x), np.cos(e), np.sin(e)
        fx, fy, fz = np.moveaxis(fore, -1, 0)
        b, d = c * fy + s * fz, c * fz - s * fy
        u, w = ce * fx - se * d, se * fx + ce * d
        wrapped = np.mod(e + np.pi, 2.0 * np.pi) - np.pi
        flexion = np.arctan2(np.hypot(u, b), -w)
        both.append(np.stack([about_x, wrapped, np.arctan2(b, u), flexion], axis=-1))
    return np.stack(both)


def limb_directions(angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns the unit directions (N,3) of upper arm and forearm of left arms with angles (N,4)."""
    a, e, r, k = np.moveaxis(angles, -1, 0)
    ca, sa, ce, se = np.cos(a), np.sin(a), np.cos(e), np.sin(e)
    upper = np.stack([-se, sa * ce, -ca * ce], axis=-1)
    # Rz(r) (sin k, 0, −cos k), then Ry(e), then Rx(a)
    px, py, pz = np.sin(k) * np.cos(r), np.sin(k) * np.sin(r), -np.cos(k)
    qx, qz = ce * px + se * pz, -se * px + ce * pz
    return upper, np.stack([qx, ca * py - sa * qz, sa * py + ca * qz], axis=-1)


def beyond_limits(upper: FloatArray, fore: FloatArray) -> FloatArray:
    """Returns (N,) by how much the joints of left arms pass their limits, in all, rad.

    Args:
        upper: (N,3) from shoulder to elbow, in the direction that the person faces, of any length.
        fore: (N,3) likewise, from elbow to hand.
    """
    angles = _near_limits(arm_angles_of(_direction(upper), _direction(fore)))
    off: FloatArray = np.abs(np.clip(angles, *LIMITS) - angles).sum(axis=-1).min(axis=0)
    return off


def _limited(
    upper: FloatArray, fore: FloatArray, front: FloatArray, side: int, allowed: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns directions (B,M,3) within the limits `allowed` (B,2,4), rad."""
    u, f = _to_torso(upper, front, side), _to_torso(fore, front, side)
    angles = _near_limits(arm_angles_of(u, f))
    low, high = allowed[:, None, 0], allowed[:, None, 1]
    bounded = np.clip(angles, low, high)
    off = np.abs(bounded - angles).sum(axis=-1)
    better = off[0] <= off[1]
    wrong = np.minimum(off[0], off[1]) > _SLACK
    if not wrong.any():
        return upper, fore
    chosen = np.where(better[..., None], bounded[0], bounded[1])[wrong]
    u, f = upper.copy(), fore.copy()
    new_upper, new_fore = limb_directions(chosen)
    u[wrong] = _from_torso(new_upper, front[wrong], side)
    f[wrong] = _from_torso(new_fore, front[wrong], side)
    return u, f


def _allowed(now: FloatArray) -> FloatArray:
    """Returns (B,2,2,4) limits of left and right arm that include the poses `now` (B,6,3)."""
    front = facing(now)
    result = np.empty((len(now), 2, 2, 4))
    for side, shoulder in enumerate((0, 3)):
        upper = _to_torso(_direction(now[:, shoulder + 1] - now[:, shoulder]), front, side)
        fore = _to_torso(_direction(now[:, shoulder + 2] - now[:, shoulder + 1]), front, side)
        angles = _near_limits(arm_angles_of(upper, fore))
        off = np.abs(np.clip(angles, *LIMITS) - angles).sum(axis=-1)
        nearer = np.where((off[0] <= off[1])[:, None], angles[0], angles[1])
        result[:, side, 0] = np.minimum(LIMITS[0], nearer)
        result[:, side, 1] = np.maximum(LIMITS[1], nearer)
    return result


def _near_limits(angles: FloatArray) -> FloatArray:
    """Returns the same angles (…,4), rad, within half a turn of the middle of their limits.

    The limits of abduction and extension go beyond ±π.
    """
    near: FloatArray = _MIDDLE + np.mod(angles - _MIDDLE + np.pi, 2.0 * np.pi) - np.pi
    return near


def _shoulders(joints: FloatArray, width: FloatArray) -> FloatArray:
    """Returns shoulders (B,M,2,3), m, that are `width` (B,1,1), m, apart."""
    left, right = joints[:, :, 0], joints[:, :, 3]
    half = 0.5 * width * _direction(left - right)
    middle = 0.5 * (left + right)
    return np.stack([middle + half, middle - half], axis=2)


def _to_torso(vectors: FloatArray, front: FloatArray, side: int) -> FloatArray:
    """Returns vectors (…,3) in the torso's frame, of right arms mirrored."""
    x, y = front[..., 0], front[..., 1]
    turned = np.stack(
        [
            x * vectors[..., 0] + y * vectors[..., 1],
            -y * vectors[..., 0] + x * vectors[..., 1],
            vectors[..., 2],
        ],
        axis=-1,
    )
    return turned if side == 0 else turned * _MIRROR


def _from_torso(vectors: FloatArray, front: FloatArray, side: int) -> FloatArray:
    v = vectors if side == 0 else vectors * _MIRROR
    x, y = front[..., 0], front[..., 1]
    return np.stack(
        [x * v[..., 0] - y * v[..., 1], y * v[..., 0] + x * v[..., 1], v[..., 2]], axis=-1
    )


def _direction(vectors: FloatArray) -> FloatArray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
