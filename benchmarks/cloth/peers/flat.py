"""Flattened triangles and hinge stiffnesses of a mesh, as other simulators require them."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray


def flat_triangles(position: FloatArray, faces: IntArray) -> FloatArray:
    """Returns each triangle in its plane (F,3,2), m; corner 0 at 0, corner 1 on the x axis."""
    first = position[faces[:, 1]] - position[faces[:, 0]]
    second = position[faces[:, 2]] - position[faces[:, 0]]
    length = np.linalg.norm(first, axis=1)
    along = np.einsum("ij,ij->i", second, first) / length
    flat = np.zeros((len(faces), 3, 2))
    flat[:, 1, 0] = length
    flat[:, 2, 0] = along
    flat[:, 2, 1] = np.sqrt(np.einsum("ij,ij->i", second, second) - along**2)
    return flat


def dihedral_stiffness(
    position: FloatArray, edge: IntArray, opposite: IntArray, bending: float
) -> FloatArray:
    """Returns (E,) moment per angle and edge length, N, for a bending stiffness `bending`.

    For small angles, a hinge of this package has the energy ½ B (l θ)² / (A₀ + A₁), one of a
    dihedral model ½ k l θ². Therefore, k = B l / (A₀ + A₁). Boundary edges (an opposite corner
    below 0) get 0.

    Args:
        position: (n,3) rest shape, m.
        edge: (E,2) end nodes of the edges.
        opposite: (E,2) corners opposite to the edges.
        bending: Bending stiffness, N·m.
    """
    inner = (opposite >= 0).all(axis=1)
    stiffness = np.zeros(len(edge))
    a, b = position[edge[inner, 0]], position[edge[inner, 1]]
    area = np.zeros(int(inner.sum()))
    for side in range(2):
        corner = position[opposite[inner, side]]
        area += 0.5 * np.linalg.norm(np.cross(b - a, corner - a), axis=1)
    stiffness[inner] = bending * np.linalg.norm(b - a, axis=1) / area
    return stiffness
