"""Bounds on joint speeds that keep limits of position, speed and acceleration, now and later."""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arm.chain import JointLimits
from drake_dress.models.arrays import FloatArray


def rate_bounds(
    q: FloatArray, rate: FloatArray, step: float, limits: JointLimits
) -> tuple[FloatArray, FloatArray]:
    """Returns lowest and highest joint speeds (J,), rad/s, for the next step.

    Within these bounds a joint can always stop before its limit, so the next step has bounds, too:
    a joint that starts within its limits and stays within the bounds never exceeds any limit. If
    `rate` leaves no such choice, the joint brakes as hard as it may.

    Args:
        q: (J,) current positions, rad.
        rate: (J,) rates of the previous step, rad/s.
        step: time step, s.
        limits: limits of the joints.
    """
    low, high = np.empty(len(q)), np.empty(len(q))
    find_rate_bounds(
        q, rate, step, limits.lower, limits.upper, limits.speed, limits.acceleration, low, high
    )
    return low, high


@nb.njit(cache=True, nogil=True)
def find_rate_bounds(q, rate, step, lower, upper, speed, acceleration, low, high):  # type: ignore[no-untyped-def]
    """Writes what `rate_bounds` returns to `low` and `high` (J,)."""
    for j in range(len(q)):
        a = acceleration[j]
        up = _stoppable(upper[j] - q[j], a, step)
        down = _stoppable(q[j] - lower[j], a, step)
        low[j] = max(-speed[j], -down, rate[j] - a * step)
        high[j] = min(speed[j], up, rate[j] + a * step)
        if low[j] > high[j]:
            # cannot happen from within the limits; from outside, the joint brakes first
            low[j] = high[j] = min(max(0.0, rate[j] - a * step), rate[j] + a * step)


@nb.njit(cache=True, nogil=True)
def _stoppable(room, a, step):  # type: ignore[no-untyped-def]
    """Returns the greatest speed, rad/s, from which a joint stops within `room`, rad.

    A joint that moves at v = k a h for a step h, and a h slower in each step after it, travels
    a h² (m + 1) (k − m/2), with m the integer part of k. For an integer k that is
    a h² k (k + 1) / 2, which gives m for a known distance.
    """
    steps = max(room, 0.0) / (a * step**2)
    m = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * steps) - 1.0))
    return a * step * (steps / (m + 1.0) + 0.5 * m)
