"""The person's bodies in a MuJoCo model: shapes, poses and velocities.

MuJoCo's mocap bodies have no velocity, so that a moving one does not carry cloth by friction. Each
limb is therefore a free body, so heavy that cloth cannot move it, whose pose and velocity are set
before each step. This is the only place that knows shapes: one for each obstacle, in order. Limbs
of one radius are MuJoCo's capsules. It has no round cones: limbs that taper are convex meshes,
whose facets lie `1 - cos(π / _SECTORS)` of the radius below the surface, 0.2 mm for 4 cm.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.mujoco.text import numbers
from drake_dress.models.round_cone import packed_cones, surface

# Mass of a body whose motion is prescribed, kg: 100 N change its velocity by 1 mm/s in 10 ms.
HEAVY = 1000.0
# Steps in which lengths and radii of round cones are taken, m: numerical errors make no new shapes.
_STEP = 1e-5
# Vertices of a round cone's mesh around it, and from its poles to where its spheres end.
_SECTORS, _RINGS = 32, 8
# Half length of a sphere's axis, m: MuJoCo's capsules divide by it.
_SHORTEST = 1e-6
# Bits by which MuJoCo decides what collides: bodies with cloth, and not with each other.
CLOTH_BIT, BODY_BIT = 1, 2


def check_shapes(obstacles: Obstacles) -> None:
    """Checks that all obstacles are limbs: round cones, capsules or spheres.

    Raises:
        ValueError: there is a half-space or a solid.
    """
    if obstacles.half_spaces.point.size or obstacles.solids:
        raise ValueError("MuJoCo's garment meets limbs only: round cones, capsules and spheres")


def shapes_of(obstacles: Obstacles) -> FloatArray:
    """Returns (count,3) length and radii of each round cone in steps of `_STEP`, m; 0 for capsules.

    A round cone that is one sphere counts as a capsule.
    """
    length = np.linalg.norm(obstacles.b - obstacles.a, axis=1)
    radius = obstacles.radius
    growth = np.abs(radius[:, 1] - radius[:, 0])
    tapers = (growth > _STEP) & (growth < length - _STEP)
    sizes = np.column_stack([length, radius]) * tapers[:, None]
    rounded: FloatArray = _STEP * np.round(sizes / _STEP)
    return rounded


def bodies_xml(shapes: FloatArray, friction: float) -> str:
    """Returns the elements of bodies with the shapes (count,3) of `shapes_of`.

    `Bodies.place` then places all, and shapes capsules.
    """
    inertia = numbers(np.full(3, HEAVY))
    bodies = []
    for k, shape in enumerate(shapes):
        kind = f'type="mesh" mesh="cone_{k}"' if shape[0] else 'type="capsule" size="0.1 0.1"'
        bodies.append(
            f'<body name="body_{k}"><freejoint/><inertial pos="0 0 0" mass="{HEAVY}" '
            f'diaginertia="{inertia}"/><geom {kind} contype="{BODY_BIT}" '
            f'conaffinity="{CLOTH_BIT}" friction="{friction:.12g} 0.005 0.0001"/></body>'
        )
    return "\n".join(bodies)


def meshes_xml(shapes: FloatArray) -> str:
    """Returns the meshes of the round cones of `bodies_xml`, whose axes are along z."""
    return "\n".join(
        f'<mesh name="cone_{k}" inertia="convex" '
        f'vertex="{numbers(surface(length, (first, second), _RINGS, _SECTORS)[0])}"/>'
        for k, (length, first, second) in enumerate(shapes)
        if length
    )


class Bodies:
    """Writes shapes and motion of the bodies into a model.

    Args:
        model: MjModel, whose first bodies and geoms are those of `bodies_xml`.
        shapes: (count,3) of `shapes_of`.
    """

    def __init__(self, model: Any, shapes: FloatArray) -> None:
        count = len(shapes)
        joint = model.body_jntadr[1 : 1 + count]
        self._q = model.jnt_qposadr[joint][:, None] + np.arange(7)
        self._v = model.jnt_dofadr[joint][:, None] + np.arange(6)
        self._capsules = np.flatnonzero(shapes[:, 0] == 0.0)
        # each capsule's bounding box, which the broad phase reads
        self._box = model.body_bvhadr[1 + self._capsules]

    @property
    def linear(self) -> npt.NDArray[np.integer]:
        """(count,3) degrees of freedom of the translations."""
        return self._v[:, :3]

    def place(self, model: Any, data: Any, obstacles: Obstacles) -> None:
        """Sets shapes, poses and velocities of the bodies to those of the obstacles."""
        a, b, cone = packed_cones(obstacles.a, obstacles.b, obstacles.radius)
        axis = b - a
        turn = _turns_from_z(axis)
        omega = obstacles.angular_velocity
        center = 0.5 * (a + b)
        data.qpos[self._q[:, :3]] = center
        data.qpos[self._q[:, 3:]] = turn
        data.qvel[self._v[:, :3]] = obstacles.velocity + np.cross(omega, center - obstacles.a)
        # MuJoCo takes the angular velocity in the body's own axes
        data.qvel[self._v[:, 3:]] = _turned_back(turn, omega)
        k = self._capsules
        r = cone[k, 0]
        half = np.maximum(0.5 * np.linalg.norm(axis[k], axis=1), _SHORTEST)
        model.geom_size[k, :2] = np.stack([r, half], axis=1)
        model.geom_rbound[k] = r + half
        box = np.stack([r, r, r + half], axis=1)
        model.geom_aabb[k, 3:] = box
        model.bvh_aabb[self._box, 3:] = box


def _turns_from_z(axis: FloatArray) -> FloatArray:
    """Returns (m,4) quaternions, w first, that turn z to the axes (m,3); 1 for axes of length 0."""
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    unit = np.where(length > _SHORTEST, axis / np.maximum(length, _SHORTEST), [0.0, 0.0, 1.0])
    zero = np.zeros(len(unit))
    q = np.stack([1.0 + unit[:, 2], -unit[:, 1], unit[:, 0], zero], axis=1)
    # an axis along −z: half a turn about x
    q[unit[:, 2] < -1.0 + 1e-12] = [0.0, 1.0, 0.0, 0.0]
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def _turned_back(q: FloatArray, vector: FloatArray) -> FloatArray:
    """Returns vectors (m,3) in the axes that the quaternions (m,4), w first, turn to."""
    w, u = q[:, :1], -q[:, 1:]
    once = np.cross(u, vector)
    turned: FloatArray = vector + 2.0 * (w * once + np.cross(u, once))
    return turned
