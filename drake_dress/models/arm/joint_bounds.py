"""Joint speeds that stay within limits of position, speed and acceleration, now and later."""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arm.chain import JointLimits
from drake_dress.models.arrays import FloatArray


def rate_bounds(
    q: FloatArray, rate: FloatArray, step: float, limits: JointLimits
) -> tuple[FloatArray, FloatArray]:
    """Returns lowest and highest joint speeds (J,), rad/s, for the next step.

    Within them a joint can always still be stopped before its limit, so that there always are
    some: who starts within limits and stays within these bounds never exceeds any. Where `rate`
    leaves no such choice the joint brakes as hard as it may.

    Args:
        q: (J,) rad, now.
        rate: (J,) rad/s, of the step before.
        step: s.
        limits: of the joints.
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
            # never reached from within; from without the way back comes first
            low[j] = high[j] = min(max(0.0, rate[j] - a * step), rate[j] + a * step)


@nb.njit(cache=True, nogil=True)
def _stoppable(room, a, step):  # type: ignore[no-untyped-def]
    """Returns the greatest speed, rad/s, from which a joint stops within `room`, rad.

    A joint that moves at v = k a h for a step h, and a h slower in each step after it, goes
    a h² (m + 1) (k − m/2), m the whole part of k. For a whole k that is a h² k (k + 1) / 2, which
    tells m of a way.
    """
    steps = max(room, 0.0) / (a * step**2)
    m = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * steps) - 1.0))
    return a * step * (steps / (m + 1.0) + 0.5 * m)
