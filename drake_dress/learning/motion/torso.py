"""Motion of the torso: sway, steps and leans that carry the shoulders, and turns."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.tremor import Wandering
from drake_dress.learning.motion.strokes import Stroke, draw_stroke

# Standard deviations of quiet stance: of its sway, m, and of yaw, roll and pitch, rad.
_SWAY = np.array([0.004, 0.003, 0.0005])
_TILT = np.array([0.006, 0.004, 0.006])
# Largest turn of the whole body, rad; leans, rad, and steps, m, likewise.
_TURN, _LEAN = 1.2, 0.45
_STEP = np.array([0.35, 0.25, 0.04])
_TURN_SPEED = 0.35  # mean, rad/s


@dataclass
class Torso:
    """Pose of the torso over time: place on the floor, then yaw, roll, pitch about the pelvis.

    Attributes:
        pelvis: height of the pelvis, m, about which the trunk leans.
        size: factor on the sway.
        origin: (2,) place on the floor, m.
        yaw: initial heading, rad.
        strokes: of (6,) place, m, and angles, rad.
    """

    pelvis: float
    size: float
    origin: FloatArray
    yaw: float
    waves: list[Wandering]
    strokes: list[Stroke] = field(default_factory=list)
    _last: tuple[float, FloatArray, FloatArray] | None = None

    @classmethod
    def drawn(cls, rng: np.random.Generator, pelvis: float) -> Torso:
        """Returns a torso at a drawn place, with a drawn heading and sway."""
        return cls(
            pelvis,
            float(np.exp(0.6 * rng.normal() - 0.3)),
            rng.uniform(-1.0, 1.0, 2),
            float(rng.uniform(-np.pi, np.pi)),
            [Wandering(rng) for _ in range(6)],
        )

    def is_moving(self, time: float) -> bool:
        """Returns whether the person moves the torso by will at `time`, s."""
        return any(s.is_on(time) for s in self.strokes)

    def pose(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Returns rotation (3,3) and origin (3,), m, of the torso's frame in the world."""
        if self._last is not None and self._last[0] == time:
            return self._last[1:]
        wave = np.array([w.value(time) for w in self.waves])
        state = self.size * wave * np.concatenate([_SWAY, _TILT])
        for stroke in self.strokes:
            state = state + stroke.position(time)
        turned = _about_z(self.yaw + state[3])
        leaned = turned @ _about_x(state[4]) @ _about_y(state[5])
        pelvis = np.array([0.0, 0.0, self.pelvis])
        place = np.array([*self.origin, 0.0]) + _about_z(self.yaw) @ state[:3]
        # a stroke that begins at this time has not moved it yet
        self._last = (time, leaned, place + pelvis - leaned @ pelvis)
        return self._last[1:]


def draw_turn(rng: np.random.Generator, start: float) -> Stroke:
    """Returns a turn of the whole body, in place or with a small step."""
    angle = rng.uniform(0.1, _TURN) * rng.choice([-1.0, 1.0])
    way = np.zeros(6)
    way[3] = angle
    way[:2] = 0.06 * rng.normal(size=2)
    duration = abs(angle) / (_TURN_SPEED * np.exp(0.4 * rng.normal()))
    return Stroke(start, float(np.clip(duration, 0.6, 4.0)), way, np.zeros(6), (2.0, 2.0))


def draw_lean(rng: np.random.Generator, start: float, duration: float, way: FloatArray) -> Stroke:
    """Returns the lean and step of a torso that goes along with a hand.

    Args:
        rng: draws the share.
        start: of the hand's movement, s.
        duration: of the hand's movement, s.
        way: (3,) of the hand in the torso's frame, m.
    """
    share = rng.uniform(0.0, 0.6) ** 1.5
    step = np.clip(share * way * [1.0, 1.0, 0.2], -_STEP, _STEP)
    forward = float(np.clip(share * 1.2 * way[0], -0.3 * _LEAN, _LEAN))
    aside = float(np.clip(-0.6 * share * way[1], -0.5 * _LEAN, 0.5 * _LEAN))
    twist = float(np.clip(share * 0.8 * rng.normal() * way[0], -0.4, 0.4))
    turned = np.concatenate([step, [twist, aside, forward]])
    shape = draw_stroke(rng, start, np.ones(1)).shape
    return Stroke(start, duration, turned, np.zeros(6), shape)


def _about_x(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _about_y(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _about_z(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
