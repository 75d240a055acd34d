"""Points of bodies in the world, from the poses that a plant tells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from drake_dress.models.arrays import FloatArray


def frames(poses: Sequence[RigidTransform], bodies: Sequence[int]) -> FloatArray:
    """Returns [R p] (k,3,4) of k bodies by their index."""
    return np.array([poses[i].GetAsMatrix34() for i in bodies])


def world_points(
    poses: Sequence[RigidTransform], bodies: Sequence[int], points: FloatArray
) -> FloatArray:
    """Returns points (k,3), each given in its body's frame, in the world, m.

    Args:
        poses: of all bodies in the world.
        bodies: index of each point's body.
        points: (k,3) m.
    """
    frame = frames(poses, bodies)
    placed: FloatArray = np.einsum("kij,kj->ki", frame[:, :, :3], points) + frame[:, :, 3]
    return placed
