"""The person's bodies in a MuJoCo model: shapes, poses and velocities.

MuJoCo's mocap bodies have no velocity, so that a moving one does not carry cloth by friction. Each
capsule is therefore a free body, so heavy that cloth cannot move it, whose pose and velocity are
set before each step. This is the only place that knows shapes: one for each obstacle, in order.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.mujoco.text import numbers

# Mass of a body whose motion is prescribed, kg: 100 N change its velocity by 1 mm/s in 10 ms.
HEAVY = 1000.0
# Half length of a sphere's axis, m: MuJoCo's capsules divide by it.
_SHORTEST = 1e-6
# Bits by which MuJoCo decides what collides: bodies with cloth, and not with each other.
CLOTH_BIT, BODY_BIT = 1, 2


def check_shapes(obstacles: Obstacles) -> None:
    """Checks that all obstacles are capsules or spheres.

    Raises:
        ValueError: there is a half-space, a solid or a limb that tapers.
    """
    if obstacles.half_spaces.point.size or obstacles.solids:
        raise ValueError("MuJoCo's garment meets capsules and spheres only")
    if np.any(obstacles.radius[:, 0] != obstacles.radius[:, 1]):
        raise ValueError("MuJoCo's garment meets limbs of one radius only")


def bodies_xml(count: int, friction: float) -> str:
    """Returns the elements of `count` capsules, which `Bodies.place` then shapes and places."""
    inertia = numbers(np.full(3, HEAVY))
    body = (
        f'<body name="body_{{}}"><freejoint/><inertial pos="0 0 0" mass="{HEAVY}" '
        f'diaginertia="{inertia}"/><geom type="capsule" size="0.1 0.1" contype="{BODY_BIT}" '
        f'conaffinity="{CLOTH_BIT}" friction="{friction:.12g} 0.005 0.0001"/></body>'
    )
    return "\n".join(body.format(k) for k in range(count))


class Bodies:
    """Writes shapes and motion of the bodies into a model.

    Args:
        model: MjModel, whose first bodies and geoms are those of `bodies_xml`.
        count: number of the bodies.
    """

    def __init__(self, model: Any, count: int) -> None:
        joint = model.body_jntadr[1 : 1 + count]
        self._q = model.jnt_qposadr[joint][:, None] + np.arange(7)
        self._v = model.jnt_dofadr[joint][:, None] + np.arange(6)
        self._geoms = slice(0, count)
        # each body's bounding box, which the broad phase reads
        self._box = model.body_bvhadr[1 : 1 + count]

    @property
    def linear(self) -> npt.NDArray[np.integer]:
        """(count,3) degrees of freedom of the translations."""
        return self._v[:, :3]

    def place(self, model: Any, data: Any, obstacles: Obstacles) -> None:
        """Sets shapes, poses and velocities of the bodies to those of the obstacles."""
        axis = obstacles.b - obstacles.a
        half = np.maximum(0.5 * np.linalg.norm(axis, axis=1), _SHORTEST)
        turn = _turns_from_z(axis)
        omega = obstacles.angular_velocity
        data.qpos[self._q[:, :3]] = 0.5 * (obstacles.a + obstacles.b)
        data.qpos[self._q[:, 3:]] = turn
        data.qvel[self._v[:, :3]] = obstacles.velocity + 0.5 * np.cross(omega, axis)
        # MuJoCo takes the angular velocity in the body's own axes
        data.qvel[self._v[:, 3:]] = _turned_back(turn, omega)
        r = obstacles.radius[:, 0]
        model.geom_size[self._geoms, :2] = np.stack([r, half], axis=1)
        model.geom_rbound[self._geoms] = r + half
        box = np.stack([r, r, r + half], axis=1)
        model.geom_aabb[self._geoms, 3:] = box
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
