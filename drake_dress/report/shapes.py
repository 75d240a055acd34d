"""Drake shapes of a person's limbs and of meshes."""

from __future__ import annotations

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import Capsule, Convex, InMemoryMesh, Mesh, Shape, Sphere
from pydrake.math import RigidTransform, RotationMatrix

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.round_cone import surface

# Colour of a wheelchair: red, green, blue.
CHAIR_COLOR = (0.30, 0.32, 0.36)
# Length of an axis below which a limb is a sphere, m.
_POINT = 1e-6


def limb_shape(
    a: FloatArray, b: FloatArray, radii: tuple[float, float], collides: bool = False
) -> tuple[Shape, RigidTransform]:
    """Returns the shape of a limb, and its pose in the frame of its ends.

    Drake has no round cone: a limb with different radii is a mesh, all of whose vertices are on the
    surface, so that its faces lie up to 0.5 % of the radius inside.

    Args:
        a: (3,) first end of the axis, m.
        b: (3,) second end, m.
        radii: radii at both ends, m.
        collides: whether the shape is for collisions, which take convex shapes.
    """
    axis = b - a
    length = float(np.linalg.norm(axis))
    if abs(radii[0] - radii[1]) >= length or length <= _POINT:
        return Sphere(max(radii)), RigidTransform(a if radii[0] >= radii[1] else b)
    X_WL = limb_pose(a, b)
    if radii[0] == radii[1]:
        return Capsule(radii[0], length), X_WL
    if collides:
        vertices, _, _ = surface(length, radii, rings=6)
        return Convex(np.unique(vertices, axis=0).T, "limb"), X_WL
    vertices, normals, faces = surface(length, radii)
    return mesh_shape(faces, vertices, normals, "limb"), X_WL


def limb_pose(a: FloatArray, b: FloatArray) -> RigidTransform:
    """Returns the pose of a limb with ends (3,), m: in the middle, z along its axis."""
    axis, center = b - a, 0.5 * (a + b)
    length = float(np.linalg.norm(axis))
    if length <= _POINT:
        return RigidTransform(center)
    return RigidTransform(RotationMatrix.MakeFromOneVector(axis / length, 2), center)


def mesh_shape(faces: IntArray, position: FloatArray, normals: FloatArray, name: str) -> Mesh:
    """Returns a mesh with triangles (F,3), vertices (n,3), m, and unit normals (n,3)."""
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in position]
    lines += [f"vn {x:.4f} {y:.4f} {z:.4f}" for x, y, z in normals]
    lines += [f"f {i}//{i} {j}//{j} {k}//{k}" for i, j, k in faces + 1]
    text = "\n".join(lines) + "\n"
    return Mesh(InMemoryMesh(mesh_file=MemoryFile(text, ".obj", name)))
