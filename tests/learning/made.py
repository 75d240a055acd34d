"""Sequences for tests: made as the data are, and simple ones of which everything is known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from drake_dress.learning.motion.scenes import make_sequence
from drake_dress.learning.motion.sequence import PERIOD, Kind
from tests.models.human.learned.drawn import Scene, drawn_scene


@dataclass(frozen=True)
class Data:
    """Sequences of equal length; see `Sequences`."""

    joint_position: np.ndarray
    sleeve: np.ndarray
    intent: np.ndarray

    def scene(self, number: int) -> Scene:
        """Returns a sequence as a scene."""
        return Scene(self.joint_position[number], self.sleeve[number])


@lru_cache
def made(kind: Kind, count: int) -> Data:
    """Returns sequences of the data."""
    found = [make_sequence(kind, 5, k) for k in range(count)]
    return Data(
        np.stack([s.joints for s in found]),
        np.stack([s.sleeves for s in found]),
        np.stack([s.intent for s in found]),
    )


def together(*parts: Data) -> Data:
    """Returns all sequences of several sets."""
    return Data(
        np.concatenate([p.joint_position for p in parts]),
        np.concatenate([p.sleeve for p in parts]),
        np.concatenate([p.intent for p in parts]),
    )


def carried(seed: int, count: int = 3, samples: int = 160) -> Data:
    """Returns persons in sleeves who are carried along at constant velocities."""
    rng = np.random.default_rng(seed)
    joints, sleeves = np.empty((count, samples, 6, 3)), np.empty((count, samples, 2, 6))
    for k in range(count):
        scene = drawn_scene(seed + k, 1)
        way = PERIOD * np.arange(samples)[:, None, None] * rng.uniform(-0.3, 0.3, 3)
        joints[k], sleeves[k] = scene.joints + way, scene.sleeves
        sleeves[k, :, :, :3] += way
    return Data(joints, sleeves, rng.integers(2, size=(count, samples, 2)))
