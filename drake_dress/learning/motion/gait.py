"""Walking in a bout: the torso travels and sways, and the arms swing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.learning.motion.sequence import DURATION
from drake_dress.models.arrays import FloatArray

# A bout begins from this time before the sequence to this share of it, and lasts this long, s.
_EARLIEST, _LATEST, _LASTS = -3.0, 0.6, (2.0, 12.0)
_SPEED, _TURNING = (0.3, 1.5), 0.25  # m/s; standard deviation, rad/s
_CADENCE = 1.4, 2.1  # steps, Hz
_BOB, _SWAY = (0.005, 0.03), (0.01, 0.04)  # half amplitudes, m
# Half amplitudes of the shoulder's angle at 1 m/s, and of the elbow's, rad.
_SWING, _BEND = (0.05, 0.4), (0.0, 0.3)
_FADE = 0.6  # s, in which it begins, and ends
_EXTENSION, _ELBOW = 1, 3  # joints


@dataclass(frozen=True)
class Gait:
    """A bout of walking.

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
        start = rng.uniform(_EARLIEST, _LATEST * DURATION)
        speed = rng.uniform(*_SPEED)
        return cls(
            float(start),
            float(start + rng.uniform(*_LASTS)),
            float(speed),
            float(_TURNING * rng.normal()),
            float(rng.uniform(*_CADENCE)),
            float(rng.uniform(*_BOB)),
            float(rng.uniform(*_SWAY)),
            float(rng.uniform(*_SWING) * speed),
            float(rng.uniform(*_BEND)),
            float(rng.uniform(0.0, 2.0 * np.pi)),
        )

    def share(self, time: float) -> float:
        """Returns the share of its speed that it has at `time`, s: it begins and ends smoothly."""
        return float(np.clip(min(time - self.start, self.end - time) / _FADE, 0.0, 1.0))

    def arm_angles(self, time: float) -> FloatArray:
        """Returns (2,4) angles that the arms swing by at `time`, s, rad."""
        wave = self.share(time) * np.sin(np.pi * self.cadence * time + self.phase)
        swing = np.zeros((2, 4))
        swing[:, _EXTENSION] = self.swing * wave, -self.swing * wave
        bent = 0.5 * self.bend * self.share(time) + 0.5 * self.bend * np.array([-wave, wave])
        swing[:, _ELBOW] = np.maximum(bent, 0.0)
        return swing

    def sway_of(self, time: float) -> FloatArray:
        """Returns the torso's offset (3,) at `time`, s: sideways and up, m."""
        angle = np.pi * self.cadence * time + self.phase
        share = self.share(time)
        return share * np.array([0.0, self.sway * np.cos(angle), self.bob * np.cos(2.0 * angle)])
