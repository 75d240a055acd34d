"""Muscle torques that move an arm to its set-point and hold it there.

The plant's joints are springs and dampers about the rest pose r. Muscles shift them to a set-point
s (equilibrium-point control; tone as in `following`):

    τ = K (s − r) + D ds/dt − G(s),

which gives −K (q − s) − D (dq/dt − ds/dt) − G(s) together with the joints: tone carries gravity's
torque G at the set-point. Without contact the arm follows a slow set-point exactly, except for its
inertia.
"""

from __future__ import annotations

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
