"""Muscle torques that move an arm to its set-point and hold it there.

The plant's joints are springs and dampers about the rest pose r. Muscles shift them to a set-point
s (equilibrium-point control; tone as in `following`):

    τ = K (s − r) + D ds/dt − G(s),

which gives −K (q − s) − D (dq/dt − ds/dt) − G(s) together with the joints: tone carries gravity's
torque G at the set-point. Without contact the arm follows a slow set-point exactly, except for its
inertia. With less tone an arm sags from the pose of its springs.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm import Arm


def muscle_torque(
    arm: Arm,
    set_point: FloatArray,
    rate: FloatArray,
    rest: FloatArray,
    stiffness: FloatArray,
    damping: FloatArray,
) -> FloatArray:
    """Returns τ (4,), N·m, to add to joints with springs and dampers about `rest`.

    Args:
        arm: its kinematics and masses.
        set_point: s (4,), rad.
        rate: ds/dt (4,), rad/s.
        rest: r (4,), rad.
        stiffness: K (4,), N·m/rad.
        damping: D (4,), N·m·s/rad.
    """
    torque: FloatArray = (
        stiffness * (set_point - rest) + damping * rate - arm.gravity_torque(set_point)
    )
    return torque


def sagged(
    arm: Arm, angles: FloatArray, stiffness: FloatArray, tone: float, limits: FloatArray
) -> FloatArray:
    """Returns the angles (4,), rad, in which an arm rests if its tone does not carry all of it.

    They minimize ½ (q − r)ᵀ K (q − r) + (1 − tone) U(q) within the limits. About them the arm moves
    as about a pose that tone holds: both have the springs K and the change of the weight's torque.

    Args:
        arm: its kinematics and masses.
        angles: r (4,), pose of the springs, rad.
        stiffness: K (4,), N·m/rad.
        tone: share of the weight that muscles carry, 0 to 1.
        limits: (2,4) lower and upper joint limits, rad.
    """
    if tone >= 1.0:
        return angles
    rest, missing = np.asarray(angles, dtype=np.float64), 1.0 - tone

    def energy(q: FloatArray) -> tuple[float, FloatArray]:
        led = q - rest
        value = 0.5 * float(led @ (stiffness * led)) + missing * arm.potential(q)
        return value, stiffness * led - missing * arm.gravity_torque(q)

    wide = np.minimum(limits[0], rest), np.maximum(limits[1], rest)
    found = minimize(
        energy, rest, jac=True, method="L-BFGS-B", bounds=list(zip(*wide, strict=True))
    )
    lowest: FloatArray = found.x
    return lowest
