"""Obstacles that the garment can touch: moving limbs, half-spaces and closed meshes.

A limb is a round cone: a capsule if its radii are equal, a sphere if its ends coincide. Each
obstacle has one owner number in the order limbs, half-spaces, solids, and moves as a rigid body
with a velocity at its origin (end a of a limb, the point of a half-space, the frame's origin of a
solid) and an angular velocity.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.signed_distance import SignedDistanceField
from drake_dress.models.round_cone import both_radii, packed_cones


@dataclass(frozen=True)
class HalfSpaces:
    """Half-spaces in the world frame. The garment stays on the side of the normals.

    Attributes:
        point: (k,3) points on the surfaces, m.
        normal: (k,3) unit normals, outward.
        velocity: (k,3) velocities of the points, m/s.
        angular_velocity: (k,3) angular velocities, rad/s.
    """

    point: FloatArray
    normal: FloatArray
    velocity: FloatArray
    angular_velocity: FloatArray

    @staticmethod
    def none() -> HalfSpaces:
        """Returns an empty set of half-spaces."""
        return HalfSpaces(*(np.zeros((0, 3)) for _ in range(4)))

    @staticmethod
    def resting(point: FloatArray, normal: FloatArray) -> HalfSpaces:
        """Returns half-spaces that do not move. Normals may have any length."""
        p = np.atleast_2d(np.asarray(point, dtype=np.float64))
        n = np.atleast_2d(np.asarray(normal, dtype=np.float64))
        return HalfSpaces(
            p, n / np.linalg.norm(n, axis=1, keepdims=True), np.zeros_like(p), np.zeros_like(p)
        )


@dataclass(frozen=True)
class Solid:
    """A closed mesh as a rigid body.

    Attributes:
        distance: signed distance in the body's frame B.
        rotation: (3,3) R_WB.
        position: (3,) p_WB, m.
        velocity: (3,) velocity of B's origin, m/s.
        angular_velocity: (3,), rad/s.
    """

    distance: SignedDistanceField
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    position: FloatArray = field(default_factory=lambda: np.zeros(3))
    velocity: FloatArray = field(default_factory=lambda: np.zeros(3))
    angular_velocity: FloatArray = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class Obstacles:
    """Everything that the garment can touch, at one instant.

    Attributes:
        a: (m,3) first ends of the limbs' axes, world frame, m.
        b: (m,3) second ends, m.
        radius: (m,2) radii at both ends, m; given as (m,), the same at both.
        velocity: (m,3) velocities of the points a, m/s.
        angular_velocity: (m,3) angular velocities, rad/s.
        half_spaces: half-spaces.
        solids: closed meshes.
    """

    a: FloatArray
    b: FloatArray
    radius: FloatArray
    velocity: FloatArray
    angular_velocity: FloatArray
    half_spaces: HalfSpaces = field(default_factory=HalfSpaces.none)
    solids: tuple[Solid, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", both_radii(self.radius))

    @property
    def count(self) -> int:
        """Number of bodies."""
        return len(self.radius) + len(self.half_spaces.point) + len(self.solids)

    @staticmethod
    def none() -> Obstacles:
        """Returns no obstacles."""
        empty = np.zeros((0, 3))
        return Obstacles(empty, empty, np.zeros((0, 2)), empty, empty)

    @staticmethod
    def resting(a: FloatArray, b: FloatArray, radius: FloatArray) -> Obstacles:
        """Returns limbs that do not move; arguments as the attributes."""
        zero = np.zeros_like(np.asarray(a, dtype=np.float64))
        return Obstacles(
            np.ascontiguousarray(a, dtype=np.float64),
            np.ascontiguousarray(b, dtype=np.float64),
            np.ascontiguousarray(radius, dtype=np.float64),
            zero,
            zero.copy(),
        )

    @staticmethod
    def floor(height: float = 0.0) -> Obstacles:
        """Returns a resting horizontal half-space whose surface is at z = `height`, m."""
        plane = HalfSpaces.resting(np.array([0.0, 0.0, height]), np.array([0.0, 0.0, 1.0]))
        return replace(Obstacles.none(), half_spaces=plane)

    def copy(self) -> Obstacles:
        """Returns a copy with its own arrays; the large signed distance fields are shared."""
        p = self.half_spaces
        planes = (p.point, p.normal, p.velocity, p.angular_velocity)
        solids = (
            Solid(
                s.distance,
                s.rotation.copy(),
                s.position.copy(),
                s.velocity.copy(),
                s.angular_velocity.copy(),
            )
            for s in self.solids
        )
        return Obstacles(
            np.array(self.a),
            np.array(self.b),
            np.array(self.radius),
            np.array(self.velocity),
            np.array(self.angular_velocity),
            HalfSpaces(*(np.array(array) for array in planes)),
            tuple(solids),
        )

    def moved(self, offset: FloatArray) -> Obstacles:
        """Returns the bodies with other poses and velocities.

        Args:
            offset: (count,4,3) for each body in the order of owners: displacement of the origin, m,
                rotation vector about it, rad, change of velocity, m/s, and change of angular
                velocity, rad/s, all in world axes. `Gradient` has the derivatives by these.
        """
        m, k = len(self.radius), len(self.half_spaces.point)
        turn = Rotation.from_rotvec(offset[:, 1])
        a = self.a + offset[:m, 0]
        p = self.half_spaces
        plane = slice(m, m + k)
        half_spaces = HalfSpaces(
            p.point + offset[plane, 0],
            turn[plane].apply(p.normal) if k else p.normal,
            p.velocity + offset[plane, 2],
            p.angular_velocity + offset[plane, 3],
        )
        solids = tuple(
            Solid(
                s.distance,
                turn[m + k + i].as_matrix() @ s.rotation,
                s.position + offset[m + k + i, 0],
                s.velocity + offset[m + k + i, 2],
                s.angular_velocity + offset[m + k + i, 3],
            )
            for i, s in enumerate(self.solids)
        )
        return Obstacles(
            a,
            a + turn[:m].apply(self.b - self.a) if m else self.b,
            self.radius,
            self.velocity + offset[:m, 2],
            self.angular_velocity + offset[:m, 3],
            half_spaces,
            solids,
        )

    @cached_property
    def packed(self) -> tuple[Any, ...]:
        """The shapes for kernels: limbs, half-spaces, and solids with their grids."""
        p, solids = self.half_spaces, self.solids
        count = len(solids)
        pose = np.zeros((count, 12))
        grid = np.zeros((count, 4))
        size = np.zeros((count, 4), dtype=np.int64)
        offset = 0
        for i, solid in enumerate(solids):
            pose[i, :9], pose[i, 9:] = solid.rotation.ravel(), solid.position
            grid[i, :3], grid[i, 3] = solid.distance.origin, solid.distance.spacing
            size[i, :3], size[i, 3] = solid.distance.coefficients.shape, offset
            offset += solid.distance.coefficients.size
        parts = [solid.distance.coefficients.ravel() for solid in solids]
        if len(parts) == 1:
            spline = parts[0]
        else:
            spline = np.concatenate(parts) if parts else np.zeros(0)
        return (
            *packed_cones(self.a, self.b, self.radius),
            p.point,
            p.normal,
            (pose, grid, size, spline),
        )

    def origins(self) -> FloatArray:
        """Returns (count,3) the points whose velocities are given, in order of owners, m."""
        return self._frames[0]

    def twists(self) -> tuple[FloatArray, FloatArray]:
        """Returns velocity of the origins (count,3), m/s, and angular velocity (count,3), rad/s."""
        return self._frames[1], self._frames[2]

    @cached_property
    def _frames(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        o = [self.a, self.half_spaces.point, *(s.position[None] for s in self.solids)]
        v = [self.velocity, self.half_spaces.velocity, *(s.velocity[None] for s in self.solids)]
        w = [self.angular_velocity, self.half_spaces.angular_velocity]
        w += [s.angular_velocity[None] for s in self.solids]
        return np.concatenate(o), np.concatenate(v), np.concatenate(w)
