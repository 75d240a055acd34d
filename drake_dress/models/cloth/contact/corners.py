"""Contact of nodes in the hollow between two bodies, such as an armpit.

A node that is kept out of its nearest body alone is driven into the other one, kept out of that in
the next step, and works its way in between. Such a node is kept off the line where both surfaces
meet instead. With gaps g and normals n of both, c = n₁·n₂, the shortest way out of both margins is

    d = α n₁ + β n₂,   α = (c g₂ - g₁) / (1 - c²),   β = (c g₁ - g₂) / (1 - c²).

If α and β are positive, the node counts as ‖d‖ deep in a surface normal to d. Otherwise the way out
of the nearest body is the way out of both.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import Proximity, surfaces_of
from drake_dress.models.cloth.contact.distance import nearest_other
from drake_dress.models.cloth.contact.obstacles import Obstacles

# Value of -c above which surfaces face each other too directly for a way out.
_FACING = 0.97


def held_off_corners(
    near: Proximity, x: FloatArray, obstacles: Obstacles, margin: float
) -> Proximity:
    """Returns `near` with nodes between two bodies kept off both.

    Args:
        near: proximity to the nearest body alone.
        x: (n,3) positions of the nodes, m.
        obstacles: bodies.
        margin: distance to keep, m.
    """
    rows = np.flatnonzero((near.gap < 0.0) & (near.owner >= 0))
    if obstacles.count < 2 or not len(rows):
        return near
    at = x[rows]
    distance, other = np.empty(len(rows)), np.empty(len(rows), dtype=np.int32)
    nearest_other(at, obstacles.packed, near.owner[rows], distance, other)
    first, second = near.gap[rows], distance - margin
    # a second body matters only if it is nearer than the depth in the first
    meets = second < -first
    if not meets.any():
        return near
    rows, first, second = rows[meets], first[meets], second[meets]
    n1, (n2, _, velocity) = near.normal[rows], surfaces_of(x[rows], obstacles, other[meets])
    c = np.einsum("ij,ij->i", n1, n2)
    free = np.maximum(1.0 - c * c, 1e-12)
    alpha, beta = (c * second - first) / free, (c * first - second) / free
    corner = (alpha > 0.0) & (beta > 0.0) & (c > -_FACING)
    if not corner.any():
        return near
    rows, alpha, beta = rows[corner], alpha[corner, None], beta[corner, None]
    out = alpha * n1[corner] + beta * n2[corner]
    depth = np.linalg.norm(out, axis=1)
    gap, normal, moving = near.gap.copy(), near.normal.copy(), near.surface_velocity.copy()
    gap[rows] = -depth
    normal[rows] = out / depth[:, None]
    moving[rows] = (alpha * moving[rows] + beta * velocity[corner]) / (alpha + beta)
    return replace(near, gap=gap, normal=normal, surface_velocity=moving)
