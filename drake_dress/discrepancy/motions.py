"""Motions to record: random paths of two grippers that reveal a garment's physics.

Each kind of motion is a path of both grippers over a few seconds that starts and ends at rest, with
random parameters, so that no two recordings are alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray

Path = Callable[[FloatArray], FloatArray]

# Time at rest before and after, s.
_STILL = 0.3


@dataclass(frozen=True)
class Stage:
    """Positions and directions for motions, world frame, m.

    Attributes:
        free: (3,) middle of the grippers, away from all obstacles.
        before: (3,) middle of the grippers with the garment in front of a limb.
        along: (3,) unit vector along that limb.
        across: (3,) horizontal unit vector from `before` to the limb.
        spread: (3,) vector from the right to the left gripper, with the garment free of tension.
        hand: (3,) hand of the raised arm; up: (3,) unit vector along that forearm to the hand.
        cuff: (3,) vector from the middle of the grippers to the cuff that the arm enters.
    """

    free: FloatArray
    before: FloatArray
    along: FloatArray
    across: FloatArray
    spread: FloatArray
    hand: FloatArray
    up: FloatArray
    cuff: FloatArray


def ease(t: FloatArray, start: float, end: float) -> FloatArray:
    """Returns 0 before `start`, 1 after `end`, and between them a polynomial that is C² overall."""
    s = np.clip((t - start) / (end - start), 0.0, 1.0)
    eased: FloatArray = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
    return eased


def sway(stage: Stage, duration: float, rng: np.random.Generator) -> Path:
    """Returns a path that oscillates in both horizontal directions, away from the person."""
    size = rng.uniform(0.025, 0.04, 2)
    rate = np.array([rng.uniform(0.75, 0.95), rng.uniform(0.5, 0.7)])

    def path(t: FloatArray) -> FloatArray:
        window = ease(t, _STILL, _STILL + 0.6) * (1.0 - ease(t, duration - 0.9, duration - 0.3))
        phase = 2.0 * np.pi * rate * (t - _STILL)[:, None]
        offset = np.zeros((len(t), 3))
        offset[:, :2] = window[:, None] * size * np.sin(phase)
        return _both(stage.free + offset, stage.spread)

    return path


def lift(stage: Stage, duration: float, rng: np.random.Generator) -> Path:
    """Returns a path that heaves fast and twists about the vertical, away from the person."""
    height, rate = rng.uniform(0.05, 0.08), rng.uniform(1.0, 1.3)
    angle, turns = rng.uniform(0.15, 0.25), rng.uniform(0.5, 0.7)

    def path(t: FloatArray) -> FloatArray:
        window = ease(t, _STILL, _STILL + 0.5) * (1.0 - ease(t, duration - 0.8, duration - 0.3))
        middle = np.tile(stage.free, (len(t), 1))
        middle[:, 2] += window * height * np.sin(2.0 * np.pi * rate * (t - _STILL))
        turn = window * angle * np.sin(2.0 * np.pi * turns * (t - _STILL))
        c, s = np.cos(turn), np.sin(turn)
        x, y, z = stage.spread
        spread = np.stack([c * x - s * y, s * x + c * y, np.full(len(t), z)], axis=1)
        return _both(middle, spread)

    return path


def drag(stage: Stage, duration: float, rng: np.random.Generator) -> Path:
    """Returns a path that presses the garment against a limb and draws it up and down over it."""
    press, rub = rng.uniform(0.25, 0.265), rng.uniform(0.055, 0.065)

    def path(t: FloatArray) -> FloatArray:
        middle = stage.before + press * ease(t, _STILL, 1.5)[:, None] * stage.across
        middle[:, 2] += rub * (ease(t, 1.5, 2.4) - 2.0 * ease(t, 2.5, 3.1) + ease(t, 3.2, 3.7))
        return _both(middle, stage.spread)

    return path


def shift(stage: Stage, duration: float, rng: np.random.Generator) -> Path:
    """Returns a path that presses the garment against a limb and draws it along, back and forth."""
    press, rub = rng.uniform(0.25, 0.265), rng.uniform(0.09, 0.11) * rng.choice([-1.0, 1.0])

    def path(t: FloatArray) -> FloatArray:
        middle = stage.before + press * ease(t, _STILL, 1.5)[:, None] * stage.across
        along = rub * (ease(t, 1.5, 2.4) - 1.6 * ease(t, 2.5, 3.1))
        return _both(middle + along[:, None] * stage.along, stage.spread)

    return path


def pull(stage: Stage, duration: float, rng: np.random.Generator) -> Path:
    """Returns a path that pulls the garment taut between the grippers, twice."""
    first, second = rng.uniform(0.015, 0.02), rng.uniform(0.032, 0.042)

    def path(t: FloatArray) -> FloatArray:
        a = ease(t, _STILL, 1.2) * (1.0 - ease(t, 1.3, 1.9))
        b = ease(t, 1.9, 2.8) * (1.0 - ease(t, 3.1, duration - 0.2))
        apart = (first * a + second * b)[:, None] * stage.spread / np.linalg.norm(stage.spread)
        return _both(np.tile(stage.free, (len(t), 1)), stage.spread + apart)

    return path


def drop(stage: Stage, duration: float, rng: np.random.Generator) -> Path:
    """Returns a path that lowers the garment fast and catches it, twice, away from the person."""
    first, second = rng.uniform(0.12, 0.16), rng.uniform(0.2, 0.25)

    def path(t: FloatArray) -> FloatArray:
        middle = np.tile(stage.free, (len(t), 1))
        middle[:, 2] -= first * (ease(t, _STILL, 0.62) - ease(t, 1.0, 1.9))
        middle[:, 2] -= second * (ease(t, 2.0, 2.4) - ease(t, 2.8, duration - _STILL))
        return _both(middle, stage.spread)

    return path


def dress(stage: Stage, duration: float, rng: np.random.Generator) -> Path:
    """Returns a path that draws a sleeve over a raised arm from its cuff, taut, and rubs it."""
    depth, rub = rng.uniform(0.18, 0.21), rng.uniform(0.045, 0.055)
    aside, taut = rng.uniform(-0.008, 0.008, 3), rng.uniform(0.03, 0.04)
    above = np.array([0.0, 0.0, 1.0]) - stage.up[2] * stage.up
    above /= np.linalg.norm(above)

    def path(t: FloatArray) -> FloatArray:
        along = 0.1 - (0.1 + depth) * ease(t, _STILL, 1.6)
        along += rub * (ease(t, 2.1, 2.6) - 2.0 * ease(t, 2.7, 3.3))
        pull = taut * ease(t, 1.5, 2.1) * (1.0 - ease(t, 3.4, 3.8))
        cuff = stage.hand + aside + along[:, None] * stage.up + pull[:, None] * above
        return _both(cuff - stage.cuff, stage.spread)

    return path


MOTIONS: dict[str, Callable[[Stage, float, np.random.Generator], Path]] = {
    "sway": sway,
    "lift": lift,
    "drag": drag,
    "shift": shift,
    "pull": pull,
    "drop": drop,
    "dress": dress,
}
# Motions during which the left arm is raised sideways.
ARM_UP = ("dress",)
# Motions of a session by default.
USUAL = ("sway", "lift", "drag", "pull", "dress")


def _both(middle: FloatArray, spread: FloatArray) -> FloatArray:
    """Returns (T,2,3) the left and the right gripper from their middle (T,3) and spread."""
    return np.stack([middle + 0.5 * spread, middle - 0.5 * spread], axis=1)
