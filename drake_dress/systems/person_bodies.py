"""The person's capsules, and the bodies of a plant that they are fixed in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.tree import BodyIndex

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.human.body import Capsule, capsule_arrays
from drake_dress.systems.body_frames import frames


class PersonBodies:
    """Computes the person's capsules from the body poses and velocities of a plant.

    Args:
        capsules: Capsules of the person, fixed in their bodies.
        body_indices: Body name to its index in the plant.

    Attributes:
        index: Indices in the plant of the bodies that have capsules.
        body_of: (k,) for each capsule, the position of its body in `index`.
        limb_of: (k,) for each capsule, the number of its limb; −1 on the trunk and legs.
        limb_count: Number of limbs: upper arms and forearms.
        radius: (k,2) radii of the capsules at both ends, m.
    """

    def __init__(self, capsules: Sequence[Capsule], body_indices: Mapping[str, BodyIndex]) -> None:
        names = sorted({c.body for c in capsules})
        limbs = [name for name in names if name.endswith("arm")]
        self.index = [int(body_indices[name]) for name in names]
        self.body_of = np.array([names.index(c.body) for c in capsules], dtype=np.int32)
        self.limb_of = np.array([limbs.index(c.body) if c.body in limbs else -1 for c in capsules])
        self.limb_count = len(limbs)
        self._a, self._b, self.radius = capsule_arrays(capsules)

    def obstacles(
        self, poses: Sequence[RigidTransform], velocities: Sequence[SpatialVelocity]
    ) -> Obstacles:
        """Returns the capsules in the world.

        Args:
            poses: Poses of all bodies of the plant, in the world.
            velocities: Velocities of the same bodies, in the world.
        """
        frame = frames(poses, self.index)[self.body_of]
        rotation, origin = frame[:, :, :3], frame[:, :, 3]
        twist = np.array([velocities[i].get_coeffs() for i in self.index])[self.body_of]
        omega = np.ascontiguousarray(twist[:, :3])
        to_a = np.einsum("kij,kj->ki", rotation, self._a)
        to_b = np.einsum("kij,kj->ki", rotation, self._b)
        velocity = twist[:, 3:] + np.cross(omega, to_a)
        return Obstacles(origin + to_a, origin + to_b, self.radius, velocity, omega)

    def origins(self, poses: Sequence[RigidTransform]) -> FloatArray:
        """Returns (bodies,3) the origins of the bodies in `index`, world, m."""
        return np.ascontiguousarray(frames(poses, self.index)[:, :, 3])
