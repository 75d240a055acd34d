"""Force on an arm's tool, from the external torques on its joints."""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arm.chain import SerialArm, find_tool_jacobian, place_links
from drake_dress.models.arrays import FloatArray

# Damping of the least squares, m: near a singular pose, directions that the joints cannot sense get
# no force.
_DAMPING = 0.01


def tool_force(jacobian: FloatArray, torque: FloatArray) -> FloatArray:
    """Returns the force (3,) on the tool's origin, N, in the frame of the jacobian.

    It is the force f whose torques J'f are nearest to the given ones, by damped least squares. The
    moment on the tool is assumed to be zero, since cloth that hangs from fingertips exerts almost
    none.

    Args:
        jacobian: (3,J) ∂(tool's velocity)/∂(joint rates), m.
        torque: (J,) external torques on the joints, N·m.
    """
    force: FloatArray = _find_force(np.ascontiguousarray(jacobian, dtype=np.float64), torque)
    return force


def gripper_motion(
    arm: SerialArm, q: FloatArray, rate: FloatArray, torque: FloatArray
) -> FloatArray:
    """Returns (3,3) rows p_WT, m, v_WT, m/s, and the force on the tool, N, in W (`tool_force`).

    Args:
        arm: the arm.
        q: (J,) joint positions, rad.
        rate: (J,) joint rates, rad/s.
        torque: (J,) external torques on the joints, N·m.
    """
    rows: FloatArray = _find_motion(arm.base, arm.joints, arm.tool, q, rate, torque)
    return rows


@nb.njit(cache=True, nogil=True)
def _find_motion(base, joints, tool, q, rate, torque):  # type: ignore[no-untyped-def]
    links = place_links(base, joints, tool, q)
    jacobian = find_tool_jacobian(links)[:3]
    rows = np.zeros((3, 3))
    for a in range(3):
        rows[0, a] = links[-1, a, 3]
        for j in range(len(q)):
            rows[1, a] += jacobian[a, j] * rate[j]
    rows[2] = _find_force(jacobian, torque)
    return rows


@nb.njit(cache=True, nogil=True)
def _find_force(jacobian, torque):  # type: ignore[no-untyped-def]
    normal, felt = _DAMPING**2 * np.eye(3), np.zeros(3)
    for a in range(3):
        for j in range(len(torque)):
            felt[a] += jacobian[a, j] * torque[j]
            for b in range(3):
                normal[a, b] += jacobian[a, j] * jacobian[b, j]
    return np.linalg.solve(normal, felt)
