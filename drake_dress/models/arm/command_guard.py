"""Model of an arm's own driver: it follows sound commands, and otherwise stops by itself.

The driver checks every command. It follows commands while they keep arriving, are finite, are
within the joints' limits and continue from where the joints are; otherwise it brakes and holds. It
resumes once commands are sound again and begin where it holds.

Commands arrive irregularly, some late and some together, so they are not passed to the drives as
they are. The drives' set-point follows the command q_c, extrapolated with its own velocity v_c
until the next command:

    v = v_c + sign(e) min(|e| / τ, √(2 a |e|)),     e = q_c + v_c age - q

within most of the joints' speed limit and within their acceleration limit. So drives never see a
jump and do not lag behind a steady motion. a is the acceleration that is left by commands which use
most of it: with a larger a, catching up could not be braked in time, and would oscillate.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numba as nb
import numpy as np

from drake_dress.models.arm.chain import JointLimits
from drake_dress.models.arrays import FloatArray


class Stop(IntEnum):
    """Why a driver does not follow its commands."""

    NONE = 0
    ENDED = 1  # none came for too long
    NOT_FINITE = 2
    OUTSIDE_LIMITS = 3  # of position or speed
    JUMP = 4  # farther from the drives' set-point than the joints could have moved


class GuardSettings(NamedTuple):
    """Settings of the driver: plain numbers, for compiled kernels.

    Attributes:
        follow_time: τ above, s.
        spare: a above, as a fraction of the acceleration limit.
        jump: tolerated jump of a command beyond what the speed limits allow, rad.
        pause: longest time between two commands of one motion, s.
        resume: distance from the held position within which commands are followed again, rad.
        braking: fraction of the acceleration limit with which the driver stops.
        speed: fraction of the speed limit up to which the driver follows, since joints overshoot.
    """

    follow_time: float = 0.02
    spare: float = 0.15
    jump: float = 0.01
    pause: float = 0.02
    resume: float = 0.03
    braking: float = 0.8
    speed: float = 0.9


@dataclass(frozen=True)
class DriveState:
    """Set-point of the drives, and the memory of the driver.

    Attributes:
        position: (J,) rad. velocity: (J,) rad/s.
        stop: why commands are not followed.
        command: (J,) the last command that was followed, rad.
        age: time since it arrived, s.
    """

    position: FloatArray
    velocity: FloatArray
    stop: Stop
    command: FloatArray
    age: float = 0.0

    def packed(self) -> FloatArray:
        """Returns the state as (3J+2,) numbers: position, velocity, stop, command, age."""
        return np.concatenate(
            [self.position, self.velocity, [float(self.stop)], self.command, [self.age]]
        )

    @staticmethod
    def unpacked(values: FloatArray) -> DriveState:
        """Returns the state from (3J+2,) numbers."""
        n = (len(values) - 2) // 3
        position, velocity = values[:n].copy(), values[n : 2 * n].copy()
        command = values[2 * n + 1 : 3 * n + 1].copy()
        return DriveState(position, velocity, Stop(int(values[2 * n])), command, float(values[-1]))

    @staticmethod
    def at_rest(position: FloatArray) -> DriveState:
        """Returns drives at rest at (J,) `position`, rad, before their first command."""
        return DriveState(position, np.zeros(len(position)), Stop.NONE, position)


def follow(
    state: DriveState,
    position: FloatArray | None,
    velocity: FloatArray | None,
    fresh: bool,
    limits: JointLimits,
    dt: float,
    settings: GuardSettings | None = None,
) -> DriveState:
    """Returns the drives' set-point after `dt`, always within speed and acceleration limits.

    Args:
        state: state of the previous step.
        position: (J,) commanded, rad; None in velocity mode.
        velocity: (J,) commanded, rad/s; None in position mode.
        fresh: whether commands still arrive.
        limits: limits of the joints, never exceeded.
        dt: time step, s.
        settings: settings of the driver.
    """
    after = np.empty(3 * len(state.position) + 2)
    _follow(
        state.packed(),
        position is not None,
        state.position.copy() if position is None else np.array(position, dtype=np.float64),
        velocity is not None,
        np.zeros(len(state.position)) if velocity is None else np.array(velocity, dtype=np.float64),
        bool(fresh),
        (limits.lower, limits.upper, limits.speed, limits.acceleration),
        float(dt),
        settings or GuardSettings(),
        after,
    )
    return DriveState.unpacked(after)


_NONE, _ENDED, _NOT_FINITE, _OUTSIDE_LIMITS, _JUMP = (int(v) for v in Stop)


@nb.njit(cache=True, nogil=True)
def _follow(state, placed, position, moving, velocity, fresh, limits, dt, s, after):  # type: ignore[no-untyped-def]
    """Writes the packed state `after`; other arguments as in `follow`.

    `placed` and `moving` say whether position and velocity are commanded; if not, position is that
    of the drives, and velocity is 0. limits: lower, upper, speed, acceleration.
    """
    n = len(position)
    lower, upper, top, acceleration = limits
    at, rate, stop, command, age = (
        state[:n],
        state[n : 2 * n],
        state[2 * n],
        state[-1 - n : -1],
        0.0,
    )
    found = _fault(state, placed, position, moving, velocity, fresh, limits, s)
    follows = found == _NONE
    # keep the reason of the stop, not what was wrong later
    after[2 * n] = found if follows or stop == _NONE else stop
    if follows and placed and (position == command).all():
        age = state[-1] + dt
    share, speed = (1.0, s.speed) if follows else (s.braking, 1.0)
    for j in range(n):
        wanted = 0.0
        if follows and placed:
            error = position[j] + min(age, s.pause) * velocity[j] - at[j]
            spare = 2.0 * s.spare * acceleration[j]
            catching_up = min(abs(error) / s.follow_time, np.sqrt(spare * abs(error)))
            wanted = (velocity[j] if age <= s.pause else 0.0) + np.sign(error) * catching_up
        elif follows:
            wanted = velocity[j]
        change = share * acceleration[j] * dt
        now = min(max(wanted, rate[j] - change), rate[j] + change)
        now = min(max(now, -speed * top[j]), speed * top[j])
        after[n + j] = now
        after[j] = min(max(at[j] + dt * now, lower[j]), upper[j])
        after[2 * n + 1 + j] = position[j] if follows and placed else after[j]
    after[-1] = age


@nb.njit(cache=True, nogil=True)
def _fault(state, placed, position, moving, velocity, fresh, limits, s):  # type: ignore[no-untyped-def]
    n = len(position)
    lower, upper, top, _ = limits
    at, rate, stop = state[:n], state[n : 2 * n], state[2 * n]
    if not fresh:
        return _ENDED
    if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
        return _NOT_FINITE
    resting = near = begins = reached = True
    for j in range(n):
        if moving and abs(velocity[j]) > top[j]:
            return _OUTSIDE_LIMITS
        if placed and (position[j] < lower[j] or position[j] > upper[j]):
            return _OUTSIDE_LIMITS
        off = abs(position[j] - at[j])
        resting = resting and abs(rate[j]) < 1e-9
        near = near and off <= s.resume
        begins = begins and abs(velocity[j]) <= s.resume / s.pause
        # the lag at full speed, and what may have been missed
        reached = reached and off <= top[j] * (s.follow_time + s.pause) + s.jump
    if stop != _NONE:
        # at rest, and commanded to continue from there
        return _NONE if resting and (near or not placed) and begins else int(stop)
    return _NONE if reached or not placed else _JUMP
