"""What pulls at an arm's tool, from the torques that it feels at its joints."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

# Of the damping of the least squares, m: directions in which an arm near a singular pose feels
# nothing are given no force.
_DAMPING = 0.01


def tool_force(jacobian: FloatArray, torque: FloatArray) -> FloatArray:
    """Returns the force (3,) on the tool's origin, N, in the frame of the jacobian.

    The force f whose torques J'f are nearest to those felt, by damped least squares; a moment on
    the tool is taken to be none, since cloth that hangs from fingertips exerts next to none.

    Args:
        jacobian: (3,J) ∂(tool's velocity)/∂(joint rates), m.
        torque: (J,) of the surroundings on the joints, N·m.
    """
    normal = jacobian @ jacobian.T + _DAMPING**2 * np.eye(3)
    return np.asarray(np.linalg.solve(normal, jacobian @ torque), dtype=np.float64)
