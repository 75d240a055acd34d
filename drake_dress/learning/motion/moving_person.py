"""A person of the data whose torso and arms move."""

from __future__ import annotations

import numpy as np

from drake_dress.learning.motion.arms import Following, MovingArm
from drake_dress.learning.motion.bodies import DrawnPerson, draw_person
from drake_dress.learning.motion.movements import Movements
from drake_dress.learning.motion.strokes import CALM, PACES
from drake_dress.learning.motion.torso import Torso, draw_lean
from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.human.body import shoulder_joint
from drake_dress.models.human.tremor import TremorWave, Wanderings
from drake_dress.models.sides import SIDES

_TREMBLES = 0.2  # share of persons with a tremor
_TREMOR, _TREMOR_FREQUENCY = (0.001, 0.006), (4.0, 7.0)  # m, Hz
# Shoulder joints move in the trunk: standard deviation at a sway of size 1, m, and largest share of
# the hand's motion.
_GIRDLE, _GIRDLE_SHARE = 0.002, 0.08
# Height of the pelvis below the shoulders, as a share of the trunk.
_PELVIS = 0.85
_OFF_COMFORT = 0.2  # standard deviation of the first pose from the comfortable one, rad


class MovingPerson:
    """A drawn person; torso and arms move as their owner has them move.

    Attributes:
        person: the drawn body.
        torso: its pose over time.
        arms: left and right.

    Args:
        rng: draws.
        clearance: how far an armhole's centre may be from the axis of an arm in it, m.
    """

    def __init__(self, rng: np.random.Generator, clearance: float = 0.0) -> None:
        self._rng = rng
        self.person: DrawnPerson = draw_person(rng)
        m = self.person.measures
        shoulders = shoulder_joint(m, self.person.posture, "left")[2]
        self.torso = Torso.drawn(rng, shoulders - _PELVIS * m.torso_length)
        self.arms = [self._arm(i, clearance) for i in (0, 1)]
        self._home = [arm.arm.hand(arm.home) for arm in self.arms]
        self._girdle = Wanderings(rng, 6)
        self._girdle_share = _GIRDLE_SHARE * rng.random()
        self._shifted = (-1.0, np.zeros((2, 3)))
        self._tremor = self._drawn_tremor()
        self._pace = float(np.exp(PACES * rng.normal() + CALM))

    def movements(self, i: int) -> Movements:
        """Returns what draws the movements of left (0) or right (1) arm."""
        arm = self.arms[i]
        return Movements(arm.arm, arm.home, arm.limits, self._rng, self._pace)

    def is_willed(self, time: float) -> BoolArray:
        """Returns (2,) whether each arm moves by will; while the torso does, both do."""
        moving = self.torso.is_moving(time)
        return np.array([moving or arm.is_willed(time) for arm in self.arms])

    def intent(self, time: float) -> BoolArray:
        """Returns (2,) whether will moves each arm to speak of now, by itself or with the torso."""
        moved = self.torso.is_moved(time)
        return np.array([moved or arm.is_moved(time) for arm in self.arms])

    def lean_with(self, arm: MovingArm, time: float, share: float) -> None:
        """Lets the torso go along with an arm's movement from `time`, s, in a `share` of cases."""
        strokes = () if arm.movement is None else arm.movement.strokes
        if not strokes or self.torso.is_moving(time) or self._rng.random() >= share:
            return
        end = max(s.end for s in strokes)
        way = sum((s.way for s in strokes), np.zeros(3))
        self.torso.strokes.append(draw_lean(self._rng, time, end - time, way))

    def joints(self, time: float, more: FloatArray | None = None) -> FloatArray:
        """Returns the joints (6,3), m, world, without tremor.

        Args:
            time: s.
            more: (2,4) angles that are added, rad.
        """
        added = np.zeros((2, 4)) if more is None else more
        return self._placed([arm.angles + a for arm, a in zip(self.arms, added, strict=True)], time)

    def trembling(self, time: float, more: FloatArray | None = None) -> FloatArray:
        """Returns the joints (6,3), m, world, with tremor.

        Args:
            time: s.
            more: (2,4) angles that are added, rad.
        """
        shaken = np.zeros((2, 4)) if more is None else more.copy()
        if self._tremor is not None:
            amplitude, waves = self._tremor
            for i, wave in enumerate(waves):
                # about the upper arm's axis and at the elbow
                shaken[i, 2:] += amplitude / self.person.measures.forearm_length * wave.value(time)
        return self.joints(time, shaken)

    def _placed(self, angles: list[FloatArray], time: float) -> FloatArray:
        """Returns the joints (6,3), m, world, of both arms with `angles`."""
        rotation, origin = self.torso.pose(time)
        if self._shifted[0] != time:
            wander = _GIRDLE * self.torso.size * self._girdle.value(time)
            self._shifted = (time, wander.reshape(2, 3))
        points = []
        for i, arm in enumerate(self.arms):
            own = arm.arm.points(angles[i])
            with_hand = self._girdle_share * (own[2] - self._home[i])
            points.append(own + self._shifted[1][i] + with_hand)
        return np.concatenate(points) @ rotation.T + origin

    def _arm(self, i: int, clearance: float) -> MovingArm:
        p, rng = self.person, self._rng
        angles = p.comfort[i] + _OFF_COMFORT * rng.normal(size=4)
        return MovingArm(
            p.arms[i],
            np.clip(angles, p.limits[i, 0], p.limits[i, 1]),
            p.comfort[i],
            p.limits[i],
            p.effort,
            Following.drawn(rng, clearance),
        )

    def _drawn_tremor(self) -> tuple[float, list[TremorWave]] | None:
        """Returns amplitude, m, and waves of a tremor; None for a person without."""
        rng = self._rng
        if rng.random() > _TREMBLES:
            return None
        frequency = rng.uniform(*_TREMOR_FREQUENCY)
        return float(rng.uniform(*_TREMOR)), [TremorWave(frequency, rng) for _ in SIDES]
