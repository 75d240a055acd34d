"""Small motions of both arms of a person who has been dressed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray

# Relative driving torques: abduction, extension, rotation, elbow.
DRIVE = np.array([1.0, 1.0, 0.0, 0.5])
_RISE = 0.5  # time in which the motion grows to its amplitude, s
_PHASES = np.array([0.0, 0.5 * np.pi])  # of left and right arm: they do not move in step


@dataclass(frozen=True)
class StirringParameters:
    """How a person moves once the coat is let go.

    Attributes:
        amplitude: half of each hand's peak-to-peak motion, m. 0 turns it off.
        frequency: frequency of the motion, Hz.

    Raises:
        UserError: a value is not a finite number, the amplitude is negative, or the frequency is
            not positive.
    """

    amplitude: float = 0.04
    frequency: float = 0.5

    def __post_init__(self) -> None:
        if not (np.isfinite(self.amplitude) and self.amplitude >= 0.0):
            raise UserError(
                "person.stirring", "amplitude", f"is {self.amplitude} m, expected 0 or more"
            )
        if not (np.isfinite(self.frequency) and self.frequency > 0.0):
            raise UserError(
                "person.stirring", "frequency", f"is {self.frequency} Hz, expected more than 0"
            )


def stirring_wave(frequency: float, elapsed: float) -> FloatArray:
    """Returns the motion (2,) of left and right arm, relative to the amplitude.

    It begins smoothly from 0.

    Args:
        frequency: Hz.
        elapsed: time since the motion began, s; before, it is 0.
    """
    if elapsed <= 0.0:
        return np.zeros(2)
    grown = min(1.0, elapsed / _RISE)
    share = grown * grown * (3.0 - 2.0 * grown)
    wave: FloatArray = share * np.sin(2.0 * np.pi * frequency * elapsed + _PHASES)
    return wave
