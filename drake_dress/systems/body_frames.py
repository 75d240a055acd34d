"""World positions of points fixed in bodies, from a plant's body poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from drake_dress.models.arrays import FloatArray


def frames(poses: Sequence[RigidTransform], bodies: Sequence[int]) -> FloatArray:
    """Returns [R p] (k,3,4) of the k bodies with these indices."""
    return np.array([poses[i].GetAsMatrix34() for i in bodies])


def world_points(
    poses: Sequence[RigidTransform], bodies: Sequence[int], points: FloatArray
) -> FloatArray:
    """Returns the world positions (k,3) of points fixed in bodies, m.

    Args:
        poses: Poses of all bodies in the world.
        bodies: Index of each point's body.
        points: (k,3) each in its body's frame, m.
    """
    frame = frames(poses, bodies)
    placed: FloatArray = np.einsum("kij,kj->ki", frame[:, :, :3], points) + frame[:, :, 3]
    return placed
