"""Movements of an arm by the person's own will: what the hand does, from a start to an end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from drake_dress.learning.motion.strokes import Stroke, draw_stroke, draw_strokes
from drake_dress.learning.motion.wave import Wave, draw_wave
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm import Arm

MovementKind = Literal["reach", "return", "fidget", "withdraw", "wave", "sleeve"]
# Movements that a person makes now and then, and their shares.
SHARES: dict[MovementKind, float] = {
    "reach": 0.45,
    "return": 0.25,
    "fidget": 0.1,
    "withdraw": 0.1,
    "wave": 0.1,
}
# Reaches that change their mind: their share, and when, as a share of the movement's duration.
_CHANGES, _CHANGES_AT = 0.2, (0.3, 0.8)
_SHORTEST_RETURN = 0.05  # m: a hand that is nearer to its comfortable place stays
_FIDGETS = 0.03  # standard deviation of a fidget, m
# Withdrawal: distance toward the shoulder, m; share of the height that the hand makes up (it stays
# low); time for which it is held, s.
_WITHDRAWS, _WITHDRAWS_UP, _HELD = (0.05, 0.25), 0.2, (0.5, 3.0)
# Reach into a sleeve: distance that the hand aims beyond the armhole, standard deviation of its
# aim, and the farthest way that a person tries, m.
_BEYOND, _MISAIMED, _FARTHEST = (-0.05, 0.1), 0.03, 0.6
# Such a reach is corrected while its armhole moves, if that changes its end by more than this, m.
_CORRECTED = 0.03
# Targets lie in a shell about the shoulder, in shares of the arm's length.
_NEAREST_TARGET, _FARTHEST_TARGET = 0.35, 0.98
# Exponents of the beta distribution of a target pose within the joints' limits: rarely at a limit.
_POSE = 1.4, 1.4
_ATTEMPTS = 20
# Targets farther behind the shoulder's plane than this, m, are mostly avoided (with this
# probability); those in the trunk, a box about its axis, are never chosen.
_BEHIND, _AVOIDED = -0.05, 0.6
_TRUNK_DEPTH, _TRUNK_HALF_WIDTH = 0.12, 0.16


class Armhole(NamedTuple):
    """An armhole that is not on its arm, in the torso's frame.

    Attributes:
        center: (3,), m.
        into: (3,) unit direction into its sleeve.
    """

    center: FloatArray
    into: FloatArray


@dataclass(frozen=True)
class Movement:
    """A movement of a hand by will.

    Attributes:
        base: (3,) where the hand begins, in the torso's frame, m.
        strokes: displacements, which add up.
        wave: a swing; None if it has none.
    """

    base: FloatArray
    strokes: tuple[Stroke, ...] = ()
    wave: Wave | None = None

    @property
    def end(self) -> float:
        """Time at which it ends, s."""
        return self.wave.end if self.wave is not None else max(s.end for s in self.strokes)

    def is_seen(self, time: float) -> bool:
        """Returns whether it moves the hand to speak of at `time`, s: not while it pauses."""
        if self.wave is not None:
            return self.wave.start < time < self.wave.end
        return any(stroke.is_seen(time) for stroke in self.strokes)

    @property
    def goal(self) -> FloatArray:
        """Where its strokes end (3,), in the torso's frame, m."""
        return self.base + sum((s.way for s in self.strokes), np.zeros(3))

    def position(self, time: float) -> FloatArray:
        """Returns the hand's place (3,) at `time`, s, in the torso's frame, m."""
        place = self.base.copy()
        for stroke in self.strokes:
            place += stroke.position(time)
        if self.wave is not None:
            place += self.wave.position(time)
        return place


@dataclass(frozen=True)
class Movements:
    """Draws the movements of an arm.

    Attributes:
        arm: kinematics.
        home: (4,) comfortable pose, rad.
        limits: (2,4) of the joints, rad.
        rng: draws.
        pace: factor on the duration of the person's movements.
    """

    arm: Arm
    home: FloatArray
    limits: FloatArray
    rng: np.random.Generator
    pace: float = 1.0

    def draw(
        self,
        kind: MovementKind,
        time: float,
        hand: FloatArray,
        armhole: Armhole | None,
        slower: float = 1.0,
    ) -> Movement | None:
        """Returns a movement that begins now; None if there is none of this kind.

        Args:
            kind: of the movement.
            time: s.
            hand: (3,) place of the hand, in the torso's frame, m.
            armhole: of the arm's sleeve; None while the arm is in it, or without a garment.
            slower: factor on its duration.
        """
        if kind == "wave":
            return Movement(hand, wave=draw_wave(self.rng, time))
        way = self._way(kind, hand, armhole)
        if way is None:
            return None
        slower = slower * self.pace
        strokes = draw_strokes(self.rng, time, way, slower)
        if kind == "reach" and self.rng.random() < _CHANGES:
            other = self._target() - hand - way
            turn = time + self.rng.uniform(*_CHANGES_AT) * (strokes[-1].end - time)
            strokes.append(draw_stroke(self.rng, turn, other, slower))
        if kind == "withdraw":
            held = strokes[-1].end + self.rng.uniform(*_HELD)
            strokes.append(draw_stroke(self.rng, held, -way, slower))
        return Movement(hand, tuple(strokes))

    def corrected(self, movement: Movement, time: float, armhole: Armhole) -> Movement:
        """Returns a reach for an armhole with a further stroke to where that is now.

        A reach that is near enough to it, or cannot get there, stays what it is.
        """
        way = self._into(armhole, movement.goal)
        if way is None or np.linalg.norm(way) < _CORRECTED:
            return movement
        stroke = draw_stroke(self.rng, time, way, self.pace)
        return replace(movement, strokes=(*movement.strokes, stroke))

    def _way(
        self, kind: MovementKind, hand: FloatArray, armhole: Armhole | None
    ) -> FloatArray | None:
        """Returns the displacement (3,), m, of a movement; None if there is none of this kind."""
        if kind == "reach":
            return self._target() - hand
        if kind == "return":
            way = self.arm.hand(self.home) - hand
            return way if np.linalg.norm(way) > _SHORTEST_RETURN else None
        if kind == "fidget":
            return _FIDGETS * self.rng.normal(size=3)
        if kind == "withdraw":
            return self._withdrawal(hand)
        return None if armhole is None else self._into(armhole, hand)

    def _withdrawal(self, hand: FloatArray) -> FloatArray:
        back = (self.arm.shoulder - hand) * [1.0, 1.0, _WITHDRAWS_UP]
        length = max(float(np.linalg.norm(back)), 1e-9)
        way: FloatArray = back * min(1.0, self.rng.uniform(*_WITHDRAWS) / length)
        return way

    def _into(self, armhole: Armhole, hand: FloatArray) -> FloatArray | None:
        """Returns the way (3,), m, through an armhole; None if it is out of reach."""
        beyond = self.rng.uniform(*_BEYOND) * armhole.into
        through = armhole.center + beyond + _MISAIMED * self.rng.normal(size=3)
        near = np.linalg.norm(through - hand) < _FARTHEST
        within = np.linalg.norm(through - self.arm.shoulder) < self.arm.length
        return through - hand if near and within else None

    def _target(self) -> FloatArray:
        """Returns a place (3,), m, that the hand can reach: of a pose within the joints' limits."""
        low, high = self.limits
        for _ in range(_ATTEMPTS):
            pose = low + (high - low) * self.rng.beta(*_POSE, 4)
            hand = self.arm.hand(pose)
            away = float(np.linalg.norm(hand - self.arm.shoulder)) / self.arm.length
            behind = hand[0] < _BEHIND and self.rng.random() < _AVOIDED
            inside = hand[0] < _TRUNK_DEPTH and abs(hand[1]) < _TRUNK_HALF_WIDTH
            if _NEAREST_TARGET < away < _FARTHEST_TARGET and not (behind or inside):
                return hand
        return self.arm.hand(self.home)
