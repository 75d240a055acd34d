"""What an arm's muscles do to go, and stay, where they are set.

The plant's joints are springs and dampers about the rest pose r. Muscles shift them to a set-point
s (equilibrium-point control; tone as in `following`):

    τ = K (s − r) + D ds/dt − G(s),

with the joints together −K (q − s) − D (dq/dt − ds/dt), and gravity's torque G is carried where the
arm is set. An arm that nothing touches follows a slow
set-point exactly, but for its inertia.
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
    """Returns τ (4,), N·m, to add to joints that are springs and dampers about `rest`.

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
