"""Whether what an arm reports can be."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drake_dress.models.arm.chain import JointLimits
from drake_dress.models.supervision.watch import Fault

# What sensors may be beyond a limit that is kept, rad, and share of speed.
_ROOM, _SHARE = 0.005, 1.05


def joint_fault(
    position: npt.ArrayLike, velocity: npt.ArrayLike, torque: npt.ArrayLike, limits: JointLimits
) -> Fault:
    """Returns what is wrong with an arm's report of its joints.

    Args:
        position: rad.
        velocity: rad/s.
        torque: of the surroundings, N·m.
        limits: (J,) of the joints.
    """
    q, v, t = (np.asarray(x, dtype=float) for x in (position, velocity, torque))
    if not q.shape == v.shape == t.shape == limits.lower.shape:
        return Fault.WRONG_SIZE
    if not (np.isfinite(q).all() and np.isfinite(v).all() and np.isfinite(t).all()):
        return Fault.NOT_FINITE
    fault = Fault.NONE
    if np.any((q < limits.lower - _ROOM) | (q > limits.upper + _ROOM)):
        fault |= Fault.JOINT_LIMIT
    if np.any(np.abs(v) > _SHARE * limits.speed):
        fault |= Fault.SPEED_LIMIT
    return fault
