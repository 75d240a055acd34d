"""A person without a garment who moves the whole body: walks, steps, bends, sits down, reaches.

Such sequences teach motion that a dressing seldom has, so that a predictor of arms is of use beside
it, too: before the garment is near, and on persons of whom nobody knows what they do.
"""

from __future__ import annotations

import numpy as np

from drake_dress.learning.motion.gait import Gait
from drake_dress.learning.motion.moving_person import MovingPerson
from drake_dress.learning.motion.sequence import COUNT, PERIOD, Sequence, is_moving
from drake_dress.learning.motion.strokes import Stroke, draw_stroke
from drake_dress.learning.motion.torso import draw_turn
from drake_dress.learning.motion.will import Will
from drake_dress.models.arrays import FloatArray

_WALKERS = 0.35  # share of persons who walk
# Movements of the whole body, how often each begins, 1/s, and of the arms: mean rest, s.
_STEPS, _BENDS, _TURNS = 0.12, 0.08, 0.08
_REST = 1.5
_FASTER = 0.6  # factor on the duration of movements; outside a dressing people are less careful
# Shares of movements that both arms make, and that the torso goes along with.
_TOGETHER, _LEANS = 0.5, 0.5
_DECIDES = 0.1  # s
# A step: its length, m, the standard deviation of the turn with it, rad, its mean speed, m/s, and
# its least duration, s.
_STEP, _STEP_TURN, _STEP_SPEED, _SHORTEST_STEP = (0.1, 0.9), 0.3, (0.25, 0.9), 0.5
# A bend, squat or sitting down: way down as a share of the leg, way forward, m, pitch, rad,
# duration of each half, s, the share of persons who stay down, and mean time until the others
# rise, s.
_DOWN, _FORWARD, _PITCH, _BEND_TIME = (0.0, 0.5), (-0.25, 0.1), (0.0, 1.0), (0.7, 2.2)
_STAY_DOWN, _DOWN_TIME = 0.3, 1.0


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
        self._wills = [
            Will(arm, self._mover.movements(i), float(rng.exponential(_REST)), dwell=_REST)
            for i, arm in enumerate(self._mover.arms)
        ]

    def run(self) -> Sequence:
        """Moves for the whole duration; returns the samples."""
        made, mover, hands = Sequence.empty(), self._mover, np.empty((COUNT, 2, 3))
        for k in range(COUNT):
            time = k * PERIOD
            gait = self._gait
            swing = None if gait is None else gait.arm_angles(time)
            made.joints[k] = self._walked(mover.trembling(time, swing), time)
            hands[k] = self._walked(mover.joints(time, swing), time)[[2, 5]]
            made.intent[k] = mover.intent(time) | (gait is not None and gait.share(time) > 0.0)
            if k % round(_DECIDES / PERIOD) == 0:
                self._decide(time)
            for arm in mover.arms:
                if arm.is_willed(time):
                    arm.move_by_will(time, PERIOD)
                else:
                    arm.follow(None, 0.0, PERIOD)
            self._walk(time)
        made.intent[~is_moving(hands)] = 0
        return made

    def _walk(self, time: float) -> None:
        """Carries the person along by one `PERIOD`."""
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
        self._decide_on_body(time)
        for i, will in enumerate(self._wills):
            kind = will.due(time, None)
            if kind is None or not will.begin(time, kind, None, slower=_FASTER):
                continue
            other = self._wills[1 - i]
            if self._rng.random() < _TOGETHER and not other.arm.is_willed(time):
                other.begin(time, kind, None, slower=_FASTER)
            self._mover.lean_with(will.arm, time, _LEANS)

    def _decide_on_body(self, time: float) -> None:
        rng, torso = self._rng, self._mover.torso
        if torso.is_moving(time):
            return
        drawn = rng.random() / _DECIDES
        if drawn < _STEPS:
            torso.strokes.append(_step(rng, time))
        elif drawn < _STEPS + _BENDS:
            torso.strokes += _bend(rng, time, self._mover.person.measures.leg_length)
        elif drawn < _STEPS + _BENDS + _TURNS:
            torso.strokes.append(draw_turn(rng, time))


def _step(rng: np.random.Generator, time: float) -> Stroke:
    """Returns a step or two to a place nearby."""
    way = np.zeros(6)
    way[:2] = rng.uniform(*_STEP) * _direction(rng)
    way[3] = _STEP_TURN * rng.normal()
    exponents = draw_stroke(rng, time, way[:3]).exponents
    duration = float(np.linalg.norm(way[:2])) / rng.uniform(*_STEP_SPEED)
    return Stroke(time, max(_SHORTEST_STEP, duration), way, np.zeros(6), exponents)


def _bend(rng: np.random.Generator, time: float, leg: float) -> list[Stroke]:
    """Returns a bow, a squat or a sitting down, and mostly the rise after it.

    Args:
        rng: draws.
        time: of its start, s.
        leg: length of the leg, m.
    """
    way = np.zeros(6)
    way[2] = -rng.uniform(*_DOWN) * leg
    way[5] = rng.uniform(*_PITCH)
    way[0] = rng.uniform(*_FORWARD)
    down = Stroke(time, rng.uniform(*_BEND_TIME), way, np.zeros(6))
    if rng.random() < _STAY_DOWN:
        return [down]
    held = down.end + rng.exponential(_DOWN_TIME)
    return [down, Stroke(held, rng.uniform(*_BEND_TIME), -way, np.zeros(6))]


def _direction(rng: np.random.Generator) -> FloatArray:
    angle = rng.uniform(-np.pi, np.pi)
    return np.array([np.cos(angle), np.sin(angle)])
