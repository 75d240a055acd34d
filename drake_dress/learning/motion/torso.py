"""Motion of the torso: sway, steps and leans that carry the shoulders, and turns."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.learning.motion.strokes import Stroke, draw_stroke
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.tremor import Wanderings
from drake_dress.models.rotation import rotation_about

# Standard deviations of quiet stance: of its sway, m, and of yaw, roll and pitch, rad.
_SWAY = np.array([0.004, 0.003, 0.0005])
_TILT = np.array([0.006, 0.004, 0.006])
# The sway of a person has a log-normal size: mean and standard deviation of its logarithm. This
# share does not sway: a back leans on a chair, or is a dummy's.
_SIZE, _SIZE_SPREAD = -0.3, 0.6
_STILL = 0.2
_ROOM = 1.0  # m, half the width of the square on which persons stand
# Turn of the whole body: angle, rad; median over turns of the mean rate, rad/s, and the standard
# deviation of its logarithm; duration, s; standard deviation of the small step with it, m.
_TURN = 0.1, 1.2
_TURN_RATE, _TURN_RATE_SPREAD = 0.25, 0.7
_TURN_TIME, _TURN_STEP = (0.6, 6.0), 0.06
# Lean with a hand: it is at most this share of the hand's way (small shares are more frequent: the
# drawn share is raised to this power).
_LEAN_SHARE, _LEAN_POWER = 0.6, 1.5
# The torso's step per share of the hand's way, and the largest step, m.
_STEP_OF_WAY, _STEP = np.array([1.0, 1.0, 0.2]), np.array([0.35, 0.25, 0.04])
# Angles per share of the hand's way, rad/m: forward, aside, twist (standard deviation).
_FORWARD, _ASIDE, _TWIST = 1.2, -0.6, 0.8
# Limits of these angles, rad: people lean forward farther than back and aside.
_MOST_FORWARD, _MOST_BACK, _MOST_ASIDE, _MOST_TWIST = 0.45, 0.3 * 0.45, 0.5 * 0.45, 0.4


@dataclass
class Torso:
    """Pose of the torso over time: place on the floor, then yaw, roll, pitch about the pelvis.

    Attributes:
        pelvis: height of the pelvis, m, about which the trunk leans.
        size: factor on the sway.
        origin: (2,) place on the floor, m.
        yaw: initial heading, rad.
        waves: of the sway, one for each of place, m, and angles, rad.
        strokes: of (6,) place, m, and angles, rad.
    """

    pelvis: float
    size: float
    origin: FloatArray
    yaw: float
    waves: Wanderings
    strokes: list[Stroke] = field(default_factory=list)
    _last: tuple[float, FloatArray, FloatArray] | None = None

    @classmethod
    def drawn(cls, rng: np.random.Generator, pelvis: float) -> Torso:
        """Returns a torso at a drawn place, with a drawn heading and sway."""
        sways = rng.random() >= _STILL
        return cls(
            pelvis,
            float(np.exp(_SIZE_SPREAD * rng.normal() + _SIZE)) if sways else 0.0,
            rng.uniform(-_ROOM, _ROOM, 2),
            float(rng.uniform(-np.pi, np.pi)),
            Wanderings(rng, 6),
        )

    def is_moving(self, time: float) -> bool:
        """Returns whether the person moves the torso by will at `time`, s."""
        return any(s.is_on(time) for s in self.strokes)

    def is_moved(self, time: float) -> bool:
        """Returns whether a movement by will moves the torso to speak of at `time`, s."""
        return any(s.is_seen(time) for s in self.strokes)

    def pose(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Returns rotation (3,3) and origin (3,), m, of the torso's frame in the world."""
        if self._last is not None and self._last[0] == time:
            # also right if a stroke has begun since: at its start it has not moved the torso yet
            return self._last[1:]
        state = self.size * self.waves.value(time) * np.concatenate([_SWAY, _TILT])
        for stroke in self.strokes:
            state = state + stroke.position(time)
        leaned = (
            rotation_about("z", self.yaw + state[3])
            @ rotation_about("x", state[4])
            @ rotation_about("y", state[5])
        )
        pelvis = np.array([0.0, 0.0, self.pelvis])
        place = np.array([*self.origin, 0.0]) + rotation_about("z", self.yaw) @ state[:3]
        self._last = (time, leaned, place + pelvis - leaned @ pelvis)
        return self._last[1:]


def draw_turn(rng: np.random.Generator, start: float) -> Stroke:
    """Returns a turn of the whole body from `start`, s, in place or with a small step."""
    angle = rng.uniform(*_TURN) * rng.choice([-1.0, 1.0])
    way = np.zeros(6)
    way[3] = angle
    way[:2] = _TURN_STEP * rng.normal(size=2)
    duration = abs(angle) / (_TURN_RATE * np.exp(_TURN_RATE_SPREAD * rng.normal()))
    return Stroke(start, float(np.clip(duration, *_TURN_TIME)), way, np.zeros(6))


def draw_lean(rng: np.random.Generator, start: float, duration: float, way: FloatArray) -> Stroke:
    """Returns the lean and step of a torso that goes along with a hand.

    Args:
        rng: draws the share.
        start: of the hand's movement, s.
        duration: of the hand's movement, s.
        way: (3,) of the hand in the torso's frame, m.
    """
    share = rng.uniform(0.0, _LEAN_SHARE) ** _LEAN_POWER
    step = np.clip(share * way * _STEP_OF_WAY, -_STEP, _STEP)
    forward = float(np.clip(share * _FORWARD * way[0], -_MOST_BACK, _MOST_FORWARD))
    aside = float(np.clip(_ASIDE * share * way[1], -_MOST_ASIDE, _MOST_ASIDE))
    twist = float(np.clip(share * _TWIST * rng.normal() * way[0], -_MOST_TWIST, _MOST_TWIST))
    turned = np.concatenate([step, [twist, aside, forward]])
    exponents = draw_stroke(rng, start, np.ones(1)).exponents
    return Stroke(start, duration, turned, np.zeros(6), exponents)
