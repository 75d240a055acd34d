"""A person and a garment, moved step by step."""

from __future__ import annotations

import numpy as np

from drake_dress.learning.motion.bodies import draw_reach
from drake_dress.learning.motion.garment import STEP, Sleeves, axes_of
from drake_dress.learning.motion.garment_draw import GarmentDraw
from drake_dress.learning.motion.movements import Armhole
from drake_dress.learning.motion.moving_person import MovingPerson
from drake_dress.learning.motion.sequence import COUNT, PERIOD, Sequence, is_moving
from drake_dress.learning.motion.torso import draw_turn
from drake_dress.learning.motion.will import Will
from drake_dress.models.arrays import FloatArray

_SUBSTEPS = round(STEP / PERIOD)
# Mean time between a person's movements by will, s: some hardly do more than help with the coat.
_DWELLS = 4.0, 40.0
# Share of active persons who reach for the armhole, and the distance at which they do, m.
_HELPERS, _HELPS = 0.85, (0.15, 0.40)
_TURNS = 0.04  # 1/s, how often the body turns
_LEANS = 0.35  # share of movements that the torso goes along with
_TOGETHER = 0.4  # share of movements that both arms make
_TOUCH = 0.06  # distance at which an armhole that is not on the arm pushes the hand along, m
_LOOSER = 0.02  # largest clearance of an arm beyond that at which its sleeve leads it, m


class DressedScene:
    """A person in a garment that two grippers move.

    Args:
        active: whether the person moves by will; else the arms only follow.
        rng: draws.
    """

    def __init__(self, active: bool, rng: np.random.Generator) -> None:
        self._rng = rng
        of = GarmentDraw.drawn(rng, draw_reach(rng))
        self._mover = MovingPerson(rng, of.beside + rng.uniform(0.0, _LOOSER))
        self._dwell = float(np.exp(rng.uniform(*np.log(_DWELLS))))
        self._wills = [self._drawn_will(i) for i in (0, 1)] if active else []
        self._axes = axes_of(self._mover.joints(0.0))
        self._before, self._way = self._axes, np.zeros((2, 3))
        self._sleeves = Sleeves.drawn(rng, of, self._axes)

    def run(self) -> Sequence:
        """Moves for the whole duration; returns the samples."""
        made, sleeves, hands = Sequence.empty(), self._sleeves, np.empty((COUNT, 2, 3))
        for k in range(COUNT):
            time = k * PERIOD
            made.joints[k] = self._mover.trembling(time)
            hands[k] = [axis.G(0.0) for axis in self._axes]
            made.sleeves[k] = np.hstack([sleeves.center, sleeves.direction])
            made.intent[k], made.on[k] = self._mover.intent(time), sleeves.on
            self._advance(k, time)
        _interpolate(made.sleeves)
        made.intent[~is_moving(hands)] = 0
        return made

    def _drawn_will(self, i: int) -> Will:
        rng = self._rng
        first = float(rng.uniform(0.0, self._dwell))
        will = Will(self._mover.arms[i], self._mover.movements(i), first, dwell=self._dwell)
        if rng.random() < _HELPERS:
            will.helps_within = float(rng.uniform(*_HELPS))
        return will

    def _advance(self, k: int, time: float) -> None:
        """Moves the person by one `PERIOD`, and the garment every `STEP`."""
        mover = self._mover
        if k % _SUBSTEPS == 0:
            self._decide(time)
            self._before = self._axes
            self._way = self._sleeves.advance(self._axes, mover.is_willed(time), time)
        for i, arm in enumerate(mover.arms):
            if arm.is_willed(time):
                arm.move_by_will(time, PERIOD)
            else:
                self._follow(i, time)
        self._axes = axes_of(mover.joints(time + PERIOD))
        if k % _SUBSTEPS == _SUBSTEPS - 1:
            self._sleeves.meet(self._axes, self._before)

    def _follow(self, i: int, time: float) -> None:
        """Lets an arm go along with its sleeve."""
        arm, axis, sleeves, way = self._mover.arms[i], self._axes[i], self._sleeves, self._way[i]
        rotation, _ = self._mover.torso.pose(time)
        led, progress = None, 0.0
        if sleeves.on[i]:
            progress = float(sleeves.progress[i])
            along = axis.D(progress)
            off = sleeves.center[i] - axis.G(progress)
            off = off - (off @ along) * along
            size = float(np.linalg.norm(off))
            excess = max(0.0, size - arm.following.clearance)
            led = off * (excess / max(size, 1e-9)) + arm.following.drag * (way @ along) * along
        elif np.linalg.norm(axis.G(0.0) - sleeves.center[i]) < _TOUCH:
            led = arm.following.drag * way
        arm.follow(None if led is None else led @ rotation, progress, PERIOD)

    def _decide(self, time: float) -> None:
        """Begins the movements whose time has come."""
        if not self._wills:
            return
        rng, torso = self._rng, self._mover.torso
        if not torso.is_moving(time) and rng.random() < _TURNS * STEP:
            torso.strokes.append(draw_turn(rng, time))
        for i, will in enumerate(self._wills):
            armhole = self._armhole(i, time)
            kind = will.due(time, armhole)
            if kind is None or not will.begin(time, kind, armhole):
                continue
            other, both = self._wills[1 - i], kind != "sleeve" and rng.random() < _TOGETHER
            if both and not other.arm.is_willed(time):
                other.begin(time, kind, self._armhole(1 - i, time))
            self._mover.lean_with(will.arm, time, _LEANS)

    def _armhole(self, i: int, time: float) -> Armhole | None:
        """Returns the armhole of a sleeve that is not on its arm, in the torso's frame."""
        if self._sleeves.on[i]:
            return None
        rotation, origin = self._mover.torso.pose(time)
        center = (self._sleeves.center[i] - origin) @ rotation
        return Armhole(center, -self._sleeves.direction[i] @ rotation)


def _interpolate(rows: FloatArray) -> None:
    """Interpolates rows (T,2,6) between the garment's steps in place; directions stay units."""
    kept = rows[::_SUBSTEPS].copy()
    for n in range(1, _SUBSTEPS):
        share = n / _SUBSTEPS
        between = (1.0 - share) * kept[:-1] + share * kept[1:]
        rows[n::_SUBSTEPS][: len(between)] = between
    length = np.linalg.norm(rows[..., 3:], axis=-1, keepdims=True)
    rows[..., 3:] /= np.maximum(length, 1e-9)
