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

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from drake_dress.models.arm.chain import JointLimits

FloatArray = npt.NDArray[np.float64]


class Stop(IntEnum):
    """Why a driver does not follow its commands."""

    NONE = 0
    ENDED = 1  # none came for too long
    NOT_FINITE = 2
    OUTSIDE_LIMITS = 3  # of position or speed
    JUMP = 4  # farther from the one before than the joints could have gone


@dataclass(frozen=True)
class GuardSettings:
    """What commands may do.

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
    s = settings or GuardSettings()
    found = _fault(state, position, velocity, fresh, limits, s)
    if found is not Stop.NONE:
        # why it stopped stays told, and not what was wrong later
        stop = found if state.stop is Stop.NONE else state.stop
        return _moved(state, np.zeros_like(state.velocity), limits, dt, stop, share=s.braking)
    rate = np.zeros_like(state.velocity) if velocity is None else velocity
    if position is None:
        return _moved(state, rate, limits, dt, Stop.NONE, speed=s.speed)
    age = 0.0 if np.any(position != state.command) else state.age + dt
    ahead = position + min(age, s.pause) * rate
    error = ahead - state.position
    catching_up = np.minimum(
        np.abs(error) / s.follow_time, np.sqrt(2.0 * s.spare * limits.acceleration * np.abs(error))
    )
    wanted = (rate if age <= s.pause else 0.0 * rate) + np.sign(error) * catching_up
    after = _moved(state, wanted, limits, dt, Stop.NONE, speed=s.speed)
    return replace(after, command=position.copy(), age=age)


def _moved(
    state: DriveState,
    wanted: FloatArray,
    limits: JointLimits,
    dt: float,
    stop: Stop,
    share: float = 1.0,
    speed: float = 1.0,
) -> DriveState:
    """Returns drives that have gone for `dt` as near to the `wanted` velocity as they may."""
    change = share * limits.acceleration * dt
    velocity = np.clip(wanted, state.velocity - change, state.velocity + change)
    velocity = np.clip(velocity, -speed * limits.speed, speed * limits.speed)
    position = np.clip(state.position + dt * velocity, limits.lower, limits.upper)
    return DriveState(position, velocity, stop, position, 0.0)


def _fault(
    state: DriveState,
    position: FloatArray | None,
    velocity: FloatArray | None,
    fresh: bool,
    limits: JointLimits,
    s: GuardSettings,
) -> Stop:
    if not fresh:
        return Stop.ENDED
    given = [x for x in (position, velocity) if x is not None]
    if not all(np.isfinite(x).all() for x in given):
        return Stop.NOT_FINITE
    outside = velocity is not None and np.any(np.abs(velocity) > limits.speed)
    if position is not None:
        outside = outside or np.any((position < limits.lower) | (position > limits.upper))
    if outside:
        return Stop.OUTSIDE_LIMITS
    if state.stop is not Stop.NONE:
        # at rest, and commanded to go on from there
        resting = np.abs(state.velocity).max() < 1e-9
        near = position is None or np.abs(position - state.position).max() <= s.resume
        begins = velocity is None or np.abs(velocity).max() <= s.resume / s.pause
        return Stop.NONE if resting and near and begins else state.stop
    if position is not None:
        # what it lags behind at full speed, and what may have been missed
        reach = limits.speed * (s.follow_time + s.pause) + s.jump
        if np.any(np.abs(position - state.position) > reach):
            return Stop.JUMP
    return Stop.NONE
