"""Voluntary motions of an active person: reach, withdraw, wave, turn.

All start and end at rest, as human movements do. They follow the minimum-jerk profile (Flash and
Hogan 1985), whose peak speed is 15/8 of the mean.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.sides import SIDES, Side

PEAK_OF_MEAN_SPEED = 15.0 / 8.0
# A wave fades in and out over this fraction of its duration, at most over this time, s.
_FADE_SHARE, _FADE_TIME = 0.25, 0.5
# Fastest turn that still is a person's change of stance, rad/s.
FASTEST_TURN = 1.5


def minimum_jerk(part: float) -> tuple[float, float]:
    """Returns position, 0 to 1, and slope of the minimum-jerk profile at `part` of its time."""
    u = min(1.0, max(0.0, part))
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2), 30.0 * u**2 * (1.0 - u) ** 2


@dataclass(frozen=True)
class Motion:
    """A motion that begins at a given time.

    Attributes:
        start: earliest time, s.
        sides: arms that perform it.
    """

    start: float = 0.0
    sides: tuple[Side, ...] = SIDES

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if entry.name == "sides":
                continue
            signed = entry.name == "angle"
            zero_is_well = entry.name in ("start", "push")
            if not np.isfinite(value) or (value < 0.0 and not signed):
                raise UserError("person.motions", entry.name, f"is {value}, expected 0 or more")
            if value == 0.0 and not (signed or zero_is_well):
                raise UserError("person.motions", entry.name, "is 0, expected more")


@dataclass(frozen=True)
class Reach(Motion):
    """The hand goes to the armhole, once it is near, and through it into the sleeve.

    Attributes:
        within: distance from hand to armhole at which the reach begins, m.
        push: distance that the hand aims beyond the armhole before it only follows, m.
    """

    within: float = 0.25
    push: float = 0.05


@dataclass(frozen=True)
class Withdraw(Motion):
    """The hand is drawn toward the body for a while, then returns to where it was.

    Attributes:
        duration: time from the start until the hand begins to return, s.
        distance: horizontal distance toward the shoulder, m.
    """

    duration: float = 4.0
    distance: float = 0.10

    def is_on(self, time: float) -> bool:
        """Returns whether the hand is drawn back at `time`, s."""
        return self.start <= time < self.start + self.duration


@dataclass(frozen=True)
class Wave(Motion):
    """The hand moves to and fro sideways.

    Attributes:
        duration: s. amplitude: m. frequency: Hz.
    """

    duration: float = 3.0
    amplitude: float = 0.05
    frequency: float = 1.0

    @property
    def speed(self) -> float:
        """Returns an upper bound of the hand's speed, m/s."""
        swelling = PEAK_OF_MEAN_SPEED / self._fade
        return self.amplitude * (2.0 * np.pi * self.frequency + swelling)

    @property
    def _fade(self) -> float:
        return min(_FADE_TIME, _FADE_SHARE * self.duration)

    def is_on(self, time: float) -> bool:
        """Returns whether the hand waves at `time`, s."""
        return self.start <= time < self.start + self.duration

    def offset(self, time: float) -> tuple[float, float]:
        """Returns the leftward offset of the hand, m, and its rate, m/s."""
        t, fade = time - self.start, self._fade
        if not self.is_on(time):
            return 0.0, 0.0
        swell, slope = minimum_jerk(t / fade)
        if t > 0.5 * self.duration:
            swell, slope = minimum_jerk((self.duration - t) / fade)
            slope = -slope
        omega = 2.0 * np.pi * self.frequency
        sine, cosine = np.sin(omega * t), np.cos(omega * t)
        return (
            float(self.amplitude * swell * sine),
            float(self.amplitude * (slope / fade * sine + swell * omega * cosine)),
        )


@dataclass(frozen=True)
class Turn(Motion):
    """The whole body turns about the vertical through the torso, and stays turned.

    Attributes:
        angle: angle of the turn, leftward (counter-clockwise seen from above) positive, rad.
        duration: duration of the turn, s.
    """

    angle: float = 0.0
    duration: float = 3.0

    @property
    def speed(self) -> float:
        """Returns the highest rate, rad/s."""
        return PEAK_OF_MEAN_SPEED * abs(self.angle) / self.duration

    def is_on(self, time: float) -> bool:
        """Returns whether the body turns at `time`, s."""
        return self.angle != 0.0 and self.start <= time < self.start + self.duration


def stance(turns: tuple[Turn, ...], time: float) -> FloatArray:
    """Returns (2,) yaw of the torso, rad, and its rate, rad/s, at `time`, s."""
    yaw = np.zeros(2)
    for turn in turns:
        part, slope = minimum_jerk((time - turn.start) / turn.duration)
        yaw += turn.angle * np.array([part, slope / turn.duration])
    return yaw
