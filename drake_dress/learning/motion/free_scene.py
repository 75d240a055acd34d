"""A person without a garment who moves with the whole body: walks, steps, bends, sits down, reaches.

Such sequences teach motion that a dressing seldom has, so that a predictor of arms is of use beside
it, too: before the garment is near, and on persons of whom nobody knows what they do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.learning.motion.moving_person import MovingPerson
from drake_dress.learning.motion.sequence import COUNT, DURATION, PERIOD, Sequence
from drake_dress.learning.motion.strokes import Stroke, draw_stroke
from drake_dress.learning.motion.torso import draw_lean, draw_turn
from drake_dress.models.arrays import FloatArray

_WALKERS = 0.35  # share of persons who walk
# Movements of the whole body, how often each begins, 1/s, and of the arms: mean rest, s.
_STEPS, _BENDS, _TURNS = 0.12, 0.08, 0.08
_REST = 1.5
_FASTER = 0.6  # factor on the duration of movements; outside a dressing people are less careful
_TOGETHER, _LEANS = 0.5, 0.5
_DECIDES = 0.1  # s


@dataclass(frozen=True)
class Gait:
    """Walking in a bout: the torso travels and sways, and the arms swing.

    Attributes:
        start, end: s. speed: m/s. turning: rad/s. cadence: steps, Hz.
        bob, sway: half amplitudes of the torso, up and sideways, m.
        swing, bend: half amplitudes of the shoulder's and the elbow's angle, rad.
        phase: of the first step, rad.
    """

    start: float
    end: float
    speed: float
    turning: float
    cadence: float
    bob: float
    sway: float
    swing: float
    bend: float
    phase: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Gait:
        """Returns a bout of walking that begins and ends within a sequence or around it."""
        start = rng.uniform(-3.0, 0.6 * DURATION)
        speed = rng.uniform(0.3, 1.5)
        return cls(
            float(start),
            float(start + rng.uniform(2.0, 12.0)),
            float(speed),
            float(0.25 * rng.normal()),
            float(rng.uniform(1.4, 2.1)),
            float(rng.uniform(0.005, 0.03)),
            float(rng.uniform(0.01, 0.04)),
            float(rng.uniform(0.05, 0.4) * speed),
            float(rng.uniform(0.0, 0.3)),
            float(rng.uniform(0.0, 2.0 * np.pi)),
        )

    def share(self, time: float) -> float:
        """Returns the share of its speed that it has at `time`: it begins and ends smoothly."""
        return float(np.clip(min(time - self.start, self.end - time) / 0.6, 0.0, 1.0))

    def arm_angles(self, time: float) -> FloatArray:
        """Returns (2,4) angles that the arms swing by, rad."""
        wave = self.share(time) * np.sin(np.pi * self.cadence * time + self.phase)
        swing = np.zeros((2, 4))
        swing[0, 1], swing[1, 1] = self.swing * wave, -self.swing * wave
        swing[:, 3] = 0.5 * self.bend * self.share(time) + 0.5 * self.bend * np.array([-wave, wave])
        swing[:, 3] = np.maximum(swing[:, 3], 0.0)
        return swing

    def sway_of(self, time: float) -> FloatArray:
        """Returns the torso's offset (3,), m: sideways and up."""
        angle = np.pi * self.cadence * time + self.phase
        share = self.share(time)
        return share * np.array([0.0, self.sway * np.cos(angle), self.bob * np.cos(2.0 * angle)])


class FreeScene:
    """A person who moves without a garment.

    Args:
        rng: draws.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._mover = MovingPerson(rng)
        self._gait = Gait.drawn(rng) if rng.random() < _WALKERS else None
        self._place, self._heading = np.zeros(2), self._mover.torso.yaw
        for arm in self._mover.arms:
            arm.next_at = float(rng.exponential(_REST))

    def run(self) -> Sequence:
        """Moves for the whole duration; returns the samples."""
        made, mover = Sequence.empty(), self._mover
        for k in range(COUNT):
            time = k * PERIOD
            gait = self._gait
            swing = None if gait is None else gait.arm_angles(time)
            made.joints[k] = self._walked(mover.trembling(time, swing), time)
            made.intent[k] = mover.is_willed(time) | (gait is not None and gait.share(time) > 0.0)
            if k % round(_DECIDES / PERIOD) == 0:
                self._decide(time)
            for arm in mover.arms:
                if arm.is_willed(time):
                    arm.move_by_will(time, PERIOD)
                else:
                    arm.follow(None, 0.0, PERIOD)
            self._walk(time)
        return made

    def _walk(self, time: float) -> None:
        if self._gait is not None:
            share = PERIOD * self._gait.share(time)
            self._heading += share * self._gait.turning
            way = np.array([np.cos(self._heading), np.sin(self._heading)])
            self._place = self._place + share * self._gait.speed * way

    def _walked(self, joints: FloatArray, time: float) -> FloatArray:
        """Returns joints (6,3), m, carried along by the walk so far."""
        if self._gait is None:
            return joints
        yaw = self._heading - self._mover.torso.yaw
        c, s = np.cos(yaw), np.sin(yaw)
        turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        place = np.array([*self._mover.torso.origin, 0.0])
        sway = turned @ self._gait.sway_of(time)
        return (joints - place) @ turned.T + place + np.array([*self._place, 0.0]) + sway

    def _decide(self, time: float) -> None:
        """Begins the movements whose time has come."""
        rng, torso, arms = self._rng, self._mover.torso, self._mover.arms
        if not torso.is_moving(time):
            drawn = rng.random() / _DECIDES
            if drawn < _STEPS:
                torso.strokes.append(_step(rng, time))
            elif drawn < _STEPS + _BENDS:
                torso.strokes += _bend(rng, time, self._mover.person.measures.leg_length)
            elif drawn < _STEPS + _BENDS + _TURNS:
                torso.strokes.append(draw_turn(rng, time))
        for i, arm in enumerate(arms):
            kind = arm.due(time, None)
            if kind is None or not arm.begin(time, kind, None, slower=_FASTER, rest=_REST):
                continue
            other = arms[1 - i]
            if rng.random() < _TOGETHER and not other.is_willed(time):
                other.begin(time, kind, None, slower=_FASTER, rest=_REST)
            if arm.strokes and not torso.is_moving(time) and rng.random() < _LEANS:
                end = max(s.end for s in arm.strokes)
                way = sum((s.way for s in arm.strokes), np.zeros(3))
                torso.strokes.append(draw_lean(rng, time, end - time, way))


def _step(rng: np.random.Generator, time: float) -> Stroke:
    """Returns a step or two to a place nearby."""
    way = np.zeros(6)
    way[:2] = rng.uniform(0.1, 0.9) * _direction(rng)
    way[3] = 0.3 * rng.normal()
    shape = draw_stroke(rng, time, way[:3]).shape
    duration = float(np.linalg.norm(way[:2])) / rng.uniform(0.25, 0.9)
    return Stroke(time, max(0.5, duration), way, np.zeros(6), shape)


def _bend(rng: np.random.Generator, time: float, leg: float) -> list[Stroke]:
    """Returns a bow, a squat or a sitting down, and mostly the rise after it."""
    way = np.zeros(6)
    way[2] = -rng.uniform(0.0, 0.5) * leg
    way[5] = rng.uniform(0.0, 1.0)
    way[0] = rng.uniform(-0.25, 0.1)
    duration = rng.uniform(0.7, 2.2)
    down = Stroke(time, duration, way, np.zeros(6), (2.0, 2.0))
    if rng.random() < 0.3:
        return [down]
    held = down.end + rng.exponential(1.0)
    return [down, Stroke(held, rng.uniform(0.7, 2.2), -way, np.zeros(6), (2.0, 2.0))]


def _direction(rng: np.random.Generator) -> FloatArray:
    angle = rng.uniform(-np.pi, np.pi)
    return np.array([np.cos(angle), np.sin(angle)])
