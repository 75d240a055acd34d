"""What an arm's own driver does with the commands that it gets: follows them, or stops by itself.

A driver trusts nobody. It follows a command while commands keep coming, are numbers, are within the
joints' limits and go on from where the one before was; otherwise it brakes by itself and holds.
It goes on once commands are sound again and begin where it holds.

Commands come when they come, some late and some together, so drives are not given them as they are.
What they are given follows the command q_c, which goes on by its own velocity v_c until the next:

    v = v_c + sign(e) min(|e| / τ, √(2 a |e|)),     e = q_c + v_c age - q

within most of the joints' speed, and their acceleration, so that drives never see a jump, and lag
behind nothing that moves steadily. a is what is left of the acceleration by commands that use
most of it: with more, what has been caught up could not be braked in time, and swings.
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
    JUMP = 4  # farther from the one before than the joints could have gone


class GuardSettings(NamedTuple):
    """What commands may do, as kernels take it: numbers alone.

    Attributes:
        follow_time: τ above, s.
        spare: a above, share of the limit of acceleration.
        jump: beyond what speed limits allow from one command to the next, rad.
        pause: between two commands at most that belong to one motion, s.
        resume: from where the driver holds, within which commands are followed again, rad.
        braking: share of the limit of acceleration at which it stops.
        speed: share of the limit of speed at which it catches up: joints overshoot.
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
    """What drives are asked for, and what a driver remembers.

    Attributes:
        position: (J,) rad. velocity: (J,) rad/s.
        stop: why not what was commanded.
        command: (J,) the last one that was followed, rad.
        age: since it came, s.
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
        """Returns the state of (3J+2,) numbers."""
        n = (len(values) - 2) // 3
        position, velocity = values[:n].copy(), values[n : 2 * n].copy()
        command = values[2 * n + 1 : 3 * n + 1].copy()
        return DriveState(position, velocity, Stop(int(values[2 * n])), command, float(values[-1]))

    @staticmethod
    def at_rest(position: FloatArray) -> DriveState:
        """Returns drives that are at (J,) `position`, rad, and have not been commanded yet."""
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
    """Returns what the drives are asked for after `dt`: within speed and acceleration always.

    Args:
        state: of the step before.
        position: (J,) commanded, rad; None in velocity mode.
        velocity: (J,) commanded, rad/s; None in position mode.
        fresh: whether commands still come.
        limits: of the joints, never exceeded.
        dt: s.
        settings: what commands may do.
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
    """Writes the packed state `after`; the rest as of `follow`.

    `placed` and `moving` tell whether position and velocity are commanded; without, position is
    that of the drives, and velocity 0. limits: lower, upper, speed, acceleration.
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
    # why it stopped stays told, and not what was wrong later
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
        # what it lags behind at full speed, and what may have been missed
        reached = reached and off <= top[j] * (s.follow_time + s.pause) + s.jump
    if stop != _NONE:
        # at rest, and commanded to go on from there
        return _NONE if resting and (near or not placed) and begins else int(stop)
    return _NONE if reached or not placed else _JUMP
