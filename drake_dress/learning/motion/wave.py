"""A hand that swings to and fro beside what else it does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.motions import minimum_jerk

# Direction of the swing in the torso's frame: sideways, and a little up and down.
_DIRECTION = np.array([0.0, 1.0, 0.3])
# It swells and fades within this share of its duration, at most within this time, s.
_FADE_SHARE, _FADE_TIME = 0.25, 0.5
# Ranges of what is drawn: duration, s, amplitude, m, frequency, Hz.
_DURATION, _AMPLITUDE, _FREQUENCY = (1.5, 4.0), (0.03, 0.15), (0.5, 1.6)


@dataclass(frozen=True)
class Wave:
    """A swing that begins and ends smoothly.

    Attributes:
        start: s. end: s. amplitude: sideways, m. frequency: Hz.
    """

    start: float
    end: float
    amplitude: float
    frequency: float

    def position(self, time: float) -> FloatArray:
        """Returns the offset (3,) of the hand at `time`, s, in the torso's frame, m."""
        if not self.start < time < self.end:
            return np.zeros(3)
        fade = min(_FADE_TIME, _FADE_SHARE * (self.end - self.start))
        swell = min(
            minimum_jerk((time - self.start) / fade)[0], minimum_jerk((self.end - time) / fade)[0]
        )
        swing = np.sin(2.0 * np.pi * self.frequency * (time - self.start))
        offset: FloatArray = self.amplitude * swell * swing * _DIRECTION
        return offset


def draw_wave(rng: np.random.Generator, start: float) -> Wave:
    """Returns a wave from `start`, s, of drawn duration, amplitude and frequency."""
    duration = rng.uniform(*_DURATION)
    return Wave(start, start + duration, rng.uniform(*_AMPLITUDE), rng.uniform(*_FREQUENCY))
