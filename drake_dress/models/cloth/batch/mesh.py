"""The garment's elements on a device, with the lists by which nodes gather from them.

Every element is a linear map from its nodes to vectors: two columns of the deformation gradient
for a triangle, one vector for a hinge. A garment of F triangles and H hinges so has M = 2F + H
element vectors, y = A x, and what elements give to nodes is Aᵀ y. Each node adds up its own row of
Aᵀ in a fixed order. Elements that added to their nodes atomically would do so in whatever order
the threads come, and rounding would differ from run to run.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import warp as wp

from drake_dress.models.cloth.elements import Elements


@wp.struct
class Mesh:
    """Elements on a device.

    Attributes:
        triangle: (F,) nodes; gradient_b, gradient_c: (F,) g of its 2nd and 3rd node; area: (F,).
        hinge: (H,) nodes; coefficient: (H,); weight, rest: (H,): see `Elements`.
        node_area: (n,) m².
        start: (n+1,), column, entry: rows of Aᵀ.
        triangle_count: F.
    """

    triangle: wp.array[wp.vec3i]
    gradient_b: wp.array[wp.vec2d]
    gradient_c: wp.array[wp.vec2d]
    area: wp.array[wp.float64]
    hinge: wp.array[wp.vec4i]
    coefficient: wp.array[wp.vec4d]
    weight: wp.array[wp.float64]
    rest: wp.array[wp.float64]
    node_area: wp.array[wp.float64]
    start: wp.array[wp.int32]
    column: wp.array[wp.int32]
    entry: wp.array[wp.float64]
    triangle_count: wp.int32


def make_mesh(elements: Elements, device: wp.Device) -> Mesh:
    """Returns the elements on a device."""
    e, mesh = elements, Mesh()
    mesh.triangle = wp.array(e.triangle, dtype=wp.vec3i, device=device)
    gradient_b = np.ascontiguousarray(e.triangle_gradient[:, 1])
    gradient_c = np.ascontiguousarray(e.triangle_gradient[:, 2])
    mesh.gradient_b = wp.array(gradient_b, dtype=wp.vec2d, device=device)
    mesh.gradient_c = wp.array(gradient_c, dtype=wp.vec2d, device=device)
    mesh.area = wp.array(e.triangle_area, dtype=wp.float64, device=device)
    mesh.hinge = wp.array(e.hinge, dtype=wp.vec4i, device=device)
    mesh.coefficient = wp.array(e.hinge_coefficient, dtype=wp.vec4d, device=device)
    mesh.weight = wp.array(e.hinge_weight, dtype=wp.float64, device=device)
    mesh.rest = wp.array(e.hinge_rest, dtype=wp.float64, device=device)
    mesh.node_area = wp.array(e.node_area, dtype=wp.float64, device=device)
    rows = _transposed_map(e)
    mesh.start = wp.array(rows.indptr.astype(np.int32), dtype=wp.int32, device=device)
    mesh.column = wp.array(rows.indices.astype(np.int32), dtype=wp.int32, device=device)
    mesh.entry = wp.array(rows.data, dtype=wp.float64, device=device)
    mesh.triangle_count = wp.int32(len(e.triangle))
    return mesh


def element_vector_count(elements: Elements) -> int:
    """Returns M."""
    return 2 * len(elements.triangle) + len(elements.hinge)


def _transposed_map(e: Elements) -> sp.csr_matrix:
    """Returns Aᵀ (n,M)."""
    faces, hinges = len(e.triangle), len(e.hinge)
    column = 2 * np.arange(faces)[:, None, None] + np.array([0, 1])
    parts = [
        (np.broadcast_to(e.triangle[:, :, None], (faces, 3, 2)), column, e.triangle_gradient),
        (e.hinge, 2 * faces + np.arange(hinges)[:, None], e.hinge_coefficient),
    ]
    row, col, data = (
        np.concatenate([np.broadcast_to(p[i], p[0].shape).ravel() for p in parts]) for i in range(3)
    )
    matrix = sp.csr_matrix((data, (row, col)), shape=(e.node_count, element_vector_count(e)))
    matrix.sort_indices()
    return matrix
