"""Joint speeds that stay within limits of position, speed and acceleration, now and later."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drake_dress.models.arm.chain import JointLimits

FloatArray = npt.NDArray[np.float64]


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
    a = limits.acceleration
    up = _stoppable(limits.upper - q, a, step)
    down = _stoppable(q - limits.lower, a, step)
    high = np.minimum(limits.speed, np.minimum(up, rate + a * step))
    low = np.maximum(-limits.speed, np.maximum(-down, rate - a * step))
    # never reached from within; from without the way back comes first
    braking = low > high
    toward = np.clip(0.0, rate - a * step, rate + a * step)
    return np.where(braking, toward, low), np.where(braking, toward, high)


def _stoppable(room: FloatArray, a: FloatArray, step: float) -> FloatArray:
    """Returns the greatest speeds, rad/s, from which joints stop within `room` (J,), rad.

    A joint that moves at v = k a h for a step h, and a h slower in each step after it, goes
    a h² (m + 1) (k − m/2), m the whole part of k. For a whole k that is a h² k (k + 1) / 2, which
    tells m of a way.
    """
    steps = np.maximum(room, 0.0) / (a * step**2)
    m = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * steps) - 1.0))
    v: FloatArray = a * step * (steps / (m + 1.0) + 0.5 * m)
    return v
