"""Wrenches of a garment on the bodies that it touches."""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray


@nb.njit(cache=True, nogil=True)
def body_wrenches(
    body_of: IntArray, origin: FloatArray, x: FloatArray, owner: IntArray, reaction: FloatArray
) -> FloatArray:
    """Returns (b,6) the moment about each body's origin, N m, and the force, N, world.

    Args:
        body_of: (k,) the body of each obstacle.
        origin: (b,3) origins of the bodies, m, world.
        x: (n,3) nodes, m, world.
        owner: (n,) obstacle that a node touches, -1 without one.
        reaction: (n,3) force of that obstacle on the node, N.
    """
    wrench = np.zeros((origin.shape[0], 6))
    for i in range(owner.shape[0]):
        if owner[i] < 0:
            continue
        b = body_of[owner[i]]
        arm, force = x[i] - origin[b], -reaction[i]
        wrench[b, 0] += arm[1] * force[2] - arm[2] * force[1]
        wrench[b, 1] += arm[2] * force[0] - arm[0] * force[2]
        wrench[b, 2] += arm[0] * force[1] - arm[1] * force[0]
        wrench[b, 3:] += force
    return wrench
