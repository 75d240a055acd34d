"""Moves a hand to a target: a smooth path, and the joint rates that follow it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm import Arm

# Shortest planned duration, s: that of a small correction.
_SHORTEST = 0.3
_DAMPING = 0.04  # of the inverse kinematics, m/rad
_FEEDBACK = 8.0  # 1/s, feedback gain on the path error of the set-point
_COMFORT = 0.5  # 1/s, gain toward the comfortable pose in the null space
_MAX_ACCELERATION = 30.0  # of a joint's set-point, rad/s²

_BRAKING = 6.0  # part of that which is assumed for braking before a limit, rad/s²
_SETTLING = 20.0  # 1/s, rate of the exponential approach to a limit at its end


@dataclass(frozen=True)
class HandPath:
    """Reference of a hand: position, velocity, acceleration (3,) in the torso's frame.

    Attributes:
        position: m. velocity: m/s. acceleration: m/s².
        remaining: time until it arrives, s.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    remaining: float = 0.0

    def toward(self, target: FloatArray, max_speed: float, step: float) -> HandPath:
        """Returns the path `step` s later on its way to `target` (3,), m, which may move.

        This is the minimum-jerk law in feedback form, jerk = 60 e/T³ − 36 v/T² − 9 a/T with the
        remaining time T (Hoff and Arbib 1993): a target at rest is reached on the minimum-jerk
        path. T is extended if the mean speed would exceed `max_speed`, m/s, and the speed itself is
        limited to it.
        """
        error = target - self.position
        least = float(np.linalg.norm(error)) / max_speed
        left = max(self.remaining - step, least, _SHORTEST)
        jerk = (
            60.0 * error / left**3 - 36.0 * self.velocity / left**2 - 9.0 * self.acceleration / left
        )
        acceleration = self.acceleration + step * jerk
        velocity = self.velocity + step * acceleration
        speed = float(np.linalg.norm(velocity))
        if speed > max_speed:
            velocity = velocity * (max_speed / speed)
        return HandPath(self.position + step * velocity, velocity, acceleration, left)


def planned_time(distance: float, max_speed: float) -> float:
    """Returns the duration, s, of a minimum-jerk movement that peaks at `max_speed`, m/s."""
    return max(_SHORTEST, 15.0 / 8.0 * distance / max_speed)


def tracking_rate(
    arm: Arm,
    angles: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    comfort: FloatArray,
    bounds: FloatArray,
    max_speed: float,
) -> FloatArray:
    """Returns joint rates (4,), rad/s, that keep the hand on its path; damped least squares.

    A hinge that would exceed its bounds moves at its bound, and the others supply the rest. While
    no hinge is at its bound, motion in the null space draws the arm toward the comfortable pose.

    Args:
        arm: its kinematics.
        angles: set-point (4,), rad.
        position: position on the path (3,), m.
        velocity: velocity on the path (3,), m/s.
        comfort: comfortable pose (4,), rad.
        bounds: (2,4) lower and upper rates, rad/s, which include zero; see `rate_bounds`.
        max_speed: largest speed of the hand, m/s.
    """
    wanted = velocity + _FEEDBACK * (position - arm.hand(angles))
    speed = float(np.linalg.norm(wanted))
    if speed > max_speed:
        wanted = wanted * (max_speed / speed)
    jacobian = arm.jacobian(angles)
    free, rate = np.ones(4, dtype=bool), np.zeros(4)
    for _ in range(4):
        J = jacobian[:, free]
        inverse = J.T @ np.linalg.inv(J @ J.T + _DAMPING**2 * np.eye(3))
        rate[free] = inverse @ (wanted - jacobian[:, ~free] @ rate[~free])
        if free.all():
            rate += _at_no_cost(J, _COMFORT * (comfort - angles))
        bounded = np.clip(rate, *bounds)
        beyond = free & (bounded != rate)
        rate = bounded
        if not beyond.any():
            break
        free &= ~beyond
    speed = float(np.linalg.norm(jacobian @ rate))
    return rate * min(1.0, max_speed / speed) if speed > 0.0 else rate


def _at_no_cost(jacobian: FloatArray, rate: FloatArray) -> FloatArray:
    """Returns the null-space part of rates (4,), which does not move the hand."""
    idle = np.linalg.svd(jacobian)[2][3]
    part: FloatArray = idle * (idle @ rate)
    return part


def rate_bounds(angles: FloatArray, limits: FloatArray, max_joint_speed: float) -> FloatArray:
    """Returns (2,4) lower and upper rates, rad/s, from which each joint can still stop in time.

    Args:
        angles: set-point (4,), rad.
        limits: (2,4) lower and upper joint limits, rad.
        max_joint_speed: largest joint speed, rad/s.
    """
    room = np.maximum([angles - limits[0], limits[1] - angles], 0.0)
    stopping = np.minimum(np.sqrt(2.0 * _BRAKING * room), _SETTLING * room)
    fastest = np.minimum(stopping, max_joint_speed)
    return np.stack([-fastest[0], fastest[1]])


def eased(wanted: FloatArray, before: FloatArray, step: float) -> FloatArray:
    """Returns rates (4,), rad/s, from `before` toward `wanted` within the joints' acceleration.

    All joints change in proportion, so the hand is never faster than at the faster of the two.
    """
    change = wanted - before
    largest = float(np.max(np.abs(change)))
    limit = _MAX_ACCELERATION * step
    rate: FloatArray = before + change * (limit / largest) if largest > limit else wanted
    return rate
