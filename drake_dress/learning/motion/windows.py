"""Draws windows of history and future from sequences, as cameras and trackers observe them.

A window is looked at by another person each time: it is drawn at any time of a sequence, some are
played slower or faster, turned a little, seen with noise, with joints hidden, with an arm or the
sleeves missing, or only since a moment ago.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from drake_dress.learning.motion.sequence import PERIOD as SAMPLED
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray
from drake_dress.models.human.learned.filling import filled
from drake_dress.models.human.learned.network import FEWEST, FUTURE, HISTORY, PERIOD
from drake_dress.models.human.learned.tokens import ArmTokens, Windows, arm_tokens

_STRIDE = PERIOD / SAMPLED
_TOGETHER = 1500  # windows of a batch, where all of some sequences are looked at


class Sequences(Protocol):
    """n sequences of S samples, 20 a second.

    Attributes:
        joint_position: (n,S,6,3) m.
        sleeve: (n,S,2,6), NaN without a garment.
        intent: (n,S,2) 0 or 1.
    """

    @property
    def joint_position(self) -> npt.NDArray[np.floating]: ...  # noqa: D102

    @property
    def sleeve(self) -> npt.NDArray[np.floating]: ...  # noqa: D102

    @property
    def intent(self) -> npt.NDArray[np.integer]: ...  # noqa: D102


@dataclass(frozen=True)
class Augmentation:
    """How windows differ from what was recorded; each is a share of windows or a width.

    Attributes:
        noise: standard deviation of the drawn standard deviation of a joint's noise, m.
        sleeve_noise: noise of sleeves over that of joints.
        sleeve_off, sleeve_turned: standard deviations of each coordinate of a lasting error of
            sleeves, m, and of their unit direction.
        noiseless: share without noise.
        paced, pace: share played at another pace, and the logarithms of slowest and fastest.
        turned: standard deviation of the heading's error, rad.
        hidden: share in which joints of one arm are hidden from some moment on.
        lost: largest standard deviation of a coordinate of a joint that is hidden all along, m;
            smaller ones are more frequent. Limbs keep their lengths.
        one_armed: share in which an arm is never seen.
        late: share in which neither joints nor sleeves were seen before some moment.
        bare: share without sleeves.
    """

    noise: float = 0.004
    sleeve_noise: float = 1.5
    sleeve_off: float = 0.01
    sleeve_turned: float = 0.25
    noiseless: float = 0.2
    paced: float = 0.4
    pace: tuple[float, float] = (-0.4, 0.8)
    turned: float = 0.2
    hidden: float = 0.25
    lost: float = 0.12
    one_armed: float = 0.05
    late: float = 0.12
    bare: float = 0.35


@dataclass(frozen=True)
class Batch:
    """Windows of B persons, 2B arms: all left arms, then all right arms.

    Attributes:
        arms: tokens and frames.
        displacement: (2B,F+1,3,3) true shoulder, elbow, hand less the last observed or filled-in
            ones, m, in the frames; row 0 is now.
        intent: (2B,) 1 where the arm moves by will now.
        willed: (2B,T+F) the same over the whole window.
        seen: (2B,3) whether shoulder, elbow and hand are observed now.
    """

    arms: ArmTokens
    displacement: FloatArray
    intent: IndexArray
    willed: IndexArray
    seen: BoolArray


class WindowSource:
    """Makes windows of sequences.

    Args:
        data: sequences.
        seed: of all that is drawn.
        augmentation: how windows are changed; None: as they are, with `noise`.
        noise: standard deviation of joints' noise without augmentation, m.
        with_sleeves: whether sleeves are shown at all.
    """

    def __init__(
        self,
        data: Sequences,
        seed: int | tuple[int, ...],
        augmentation: Augmentation | None = None,
        noise: float = 0.0,
        with_sleeves: bool = True,
    ) -> None:
        self._data, self._rng = data, np.random.default_rng(seed)
        self._how, self._noise, self._with_sleeves = augmentation, noise, with_sleeves
        self._bare = ~np.isfinite(data.sleeve[:, 0, 0, 0])
        self._length = data.joint_position.shape[1]

    def drawn(self, count: int) -> Batch:
        """Returns `count` windows at drawn times of drawn sequences."""
        rng, how = self._rng, self._how
        number = rng.integers(len(self._data.joint_position), size=count)
        pace = np.ones(count)
        if how is not None:
            pace = np.where(rng.random(count) < how.paced, np.exp(rng.uniform(*how.pace, count)), 1)
        first, last = self._limits(pace)
        pace[first > last] = 1.0
        first, last = self._limits(pace)
        return self.at(number, first + (last - first) * rng.random(count), pace)

    def grid(self, every: float) -> tuple[IndexArray, FloatArray]:
        """Returns sequence numbers and times, in samples, of windows `every` s apart."""
        first, last = self._limits(np.ones(1))
        times = np.arange(first[0], last[0] + 1e-9, every / SAMPLED)
        number, time = np.meshgrid(np.arange(len(self._data.joint_position)), times, indexing="ij")
        return number.ravel(), time.ravel()

    def every(self, apart: float, together: int = _TOGETHER) -> list[Batch]:
        """Returns all windows, `apart` s from each other, in batches of about `together`."""
        number, time = self.grid(apart)
        parts = np.array_split(np.arange(len(number)), max(1, len(number) // together))
        return [self.at(number[part], time[part]) for part in parts]

    def at(self, number: IndexArray, time: FloatArray, pace: FloatArray | None = None) -> Batch:
        """Returns the windows of sequences `number` (B,) whose now is `time` (B,), in samples.

        Args:
            number: of the sequences.
            time: index of the sample that is now, possibly fractional.
            pace: (B,) factor on their speed; 1 if None.
        """
        pace = np.ones(len(number)) if pace is None else pace
        joints, sleeves, willed = self._interpolated(number, time, pace)
        observed, shown = joints[:, :HISTORY].copy(), sleeves[:, :HISTORY].copy()
        visible = np.ones((*shown.shape[:2], 2), dtype=bool) & self._with_sleeves
        visible[self._bare[number]] = False
        self._add_noise(observed, shown)
        turned = first = None
        if self._how is not None:
            turned = self._how.turned * self._rng.normal(size=len(number))
            visible[self._rng.random(len(number)) < self._how.bare] = False
            first = self._hide(observed, visible)
        complete, seen = filled(observed, first)
        shown[~visible] = 0.0
        arms = arm_tokens(Windows(complete, seen, shown, visible, PERIOD), turned)
        true = arms.frames.joints(joints[:, HISTORY - 1 :])
        now = np.concatenate([seen[:, -1, :3], seen[:, -1, 3:]])
        willed = np.concatenate([willed[:, :, 0], willed[:, :, 1]])
        return Batch(
            arms,
            true[:, :, :3] - arms.joints[:, -1:, :3],
            willed[:, HISTORY - 1],
            willed,
            now,
        )

    def _limits(self, pace: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns first and last possible index of now."""
        first = (HISTORY - 1) * _STRIDE * pace
        return first, self._length - 1 - FUTURE * _STRIDE * pace

    def _interpolated(
        self, number: IndexArray, time: FloatArray, pace: FloatArray
    ) -> tuple[FloatArray, FloatArray, IndexArray]:
        offsets = np.arange(1 - HISTORY, FUTURE + 1) * _STRIDE
        at = np.clip(time[:, None] + offsets * pace[:, None], 0.0, self._length - 1.001)
        low = at.astype(np.int64)
        share = (at - low)[:, :, None, None]
        rows = number[:, None]

        def between(values: npt.NDArray[np.floating]) -> FloatArray:
            mixed: FloatArray = (1.0 - share) * values[rows, low] + share * values[rows, low + 1]
            return mixed

        nearest = np.rint(at).astype(np.int64)
        return (
            between(self._data.joint_position),
            between(self._data.sleeve),
            self._data.intent[rows, nearest].astype(np.int64),
        )

    def _add_noise(self, joints: FloatArray, sleeves: FloatArray) -> None:
        rng, how = self._rng, self._how
        size = np.full((len(joints), 1, 1, 1), self._noise)
        more = Augmentation.sleeve_noise
        if how is not None:
            size = how.noise * np.abs(rng.normal(size=size.shape))
            size[rng.random(len(joints)) < how.noiseless] = 0.0
            more = how.sleeve_noise
        joints += size * rng.normal(size=joints.shape)
        sleeves[..., :3] += more * size * rng.normal(size=sleeves[..., :3].shape)
        if how is not None:
            # what a tracker takes to be the armhole is a little beside it, and looks elsewhere
            lasting = rng.normal(size=(len(sleeves), 1, 2, 6))
            sleeves[..., :3] += how.sleeve_off * lasting[..., :3]
            turned = sleeves[..., 3:] + how.sleeve_turned * lasting[..., 3:]
            sleeves[..., 3:] = turned / np.linalg.norm(turned, axis=-1, keepdims=True)

    def _hide(self, joints: FloatArray, visible: BoolArray) -> FloatArray:
        """Hides joints (NaN) and sleeves of some windows; returns joints before, (B,6,3), m.

        A joint before is where it was, with an error, if it is hidden from the first sample on.
        """
        rng, how, count = self._rng, self._how, len(joints)
        assert how is not None
        arm = 3 * rng.integers(2, size=count)
        which = [[2], [1], [1, 2]]
        kind = rng.integers(3, size=count)
        since = np.minimum(rng.integers(1, HISTORY + 6, size=count), HISTORY)
        first = np.full((count, 6, 3), np.nan)
        for b in np.flatnonzero(rng.random(count) < how.hidden):
            hidden = [arm[b] + k for k in which[kind[b]]]
            if since[b] == HISTORY:
                first[b, hidden] = _misplaced(joints[b, 0], hidden, how.lost, rng)
            joints[b, HISTORY - since[b] :, hidden] = np.nan
        for b in np.flatnonzero(rng.random(count) < how.one_armed):
            joints[b, :, 3 - arm[b] : 6 - arm[b]] = np.nan
        begin = rng.integers(1, HISTORY - FEWEST + 1, size=count)
        for b in np.flatnonzero(rng.random(count) < how.late):
            joints[b, : begin[b]], visible[b, : begin[b]] = np.nan, False
        return first


def _misplaced(
    pose: FloatArray, hidden: Sequence[int], most: float, rng: np.random.Generator
) -> FloatArray:
    """Returns where `hidden` joints of a pose (6,3) are believed to be, m; limbs keep lengths.

    Args:
        pose: true joints, m.
        hidden: rows of joints of one arm, from the shoulder on.
        most: largest standard deviation of a coordinate, m.
        rng: draws.
    """
    believed, size = pose.copy(), most * rng.random() ** 2
    for row in hidden:
        limb = pose[row] - pose[row - 1]
        off = believed[row] + size * rng.normal(size=3) - believed[row - 1]
        length = np.linalg.norm(limb) / max(float(np.linalg.norm(off)), 1e-9)
        believed[row] = believed[row - 1] + length * off
    return believed[list(hidden)]
