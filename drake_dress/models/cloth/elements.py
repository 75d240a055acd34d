"""The garment as elements: triangles that stretch and hinges that bend.

Everything here depends on the rest shape alone. A triangle maps its nodes to the 3×2 deformation
gradient F = Σ x_i ⊗ g_i. A hinge (two triangles that share an edge) maps its four nodes to one
vector Σ c_i x_i, parallel to the mean curvature normal. Both are the operators A_i of the
paper's energy (Eq. Wx).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray, IntArray

# Elements that a kernel processes at once. Vector units need the same value of many elements side
# by side, and the data of this many fit in the L1 cache.
LANES = 32


@dataclass(frozen=True)
class Elements:
    """Rest-shape data of a triangle mesh.

    Attributes:
        node_count: n.
        rest_position: (n,3) rest shape, m.
        triangle: (F,3) node indices.
        triangle_gradient: (F,3,2) g_i of each corner, 1/m, in an orthonormal frame of the triangle.
        triangle_area: (F,) rest area, m².
        hinge: (H,4) node indices: the shared edge first, then the two opposite corners.
        hinge_coefficient: (H,4) c_i, dimensionless.
        hinge_weight: (H,) 1 / (area of the two triangles), 1/m²; the hinge's energy is
            ½ B weight (‖Σ c x‖ − rest)². (Bergou et al. 2006 have 3 in place of 1. A sheet bent to
            a cylinder then stores three times ½ B κ² on equilateral triangles and on a grid bent
            along its lines, 4.5 times across the diagonals of a grid. With 1, a strip droops by its
            bending length.)
        hinge_rest: (H,) ‖Σ c x‖ at rest, m.
        node_area: (n,) a third of the area of the triangles around a node, m².
        edge: (E,2) unique edges; edge_rest_length: (E,) m.
        triangle_lanes: (⌈F/L⌉,3,L) `triangle` in tiles of L = LANES, padded with zero-area
            triangles at node 0.
        gradient_lanes: (⌈F/L⌉,5,L) g_1, g_2 (g_0 = −g_1 − g_2) and area, likewise.
        hinge_lanes: (⌈H/L⌉,4,L) `hinge`, likewise.
        bend_lanes: (⌈H/L⌉,6,L) coefficients, weight and rest of the hinges, likewise.
    """

    node_count: int
    rest_position: FloatArray
    triangle: IntArray
    triangle_gradient: FloatArray
    triangle_area: FloatArray
    hinge: IntArray
    hinge_coefficient: FloatArray
    hinge_weight: FloatArray
    hinge_rest: FloatArray
    node_area: FloatArray
    edge: IntArray
    edge_rest_length: FloatArray
    triangle_lanes: npt.NDArray[np.uint32]
    gradient_lanes: FloatArray
    hinge_lanes: npt.NDArray[np.uint32]
    bend_lanes: FloatArray


def make_elements(
    rest_position: FloatArray,
    faces: npt.NDArray[np.integer],
    corners: FloatArray | None = None,
) -> Elements:
    """Returns the elements of a triangle mesh.

    Args:
        rest_position: (n,3) rest shape, m.
        faces: (F,3) node indices, consistently oriented, manifold.
        corners: (F,3,2) rest shape of each triangle by itself, counter-clockwise or not, m, such as
            in the flat panels that a garment is sewn of. Hinges then rest flat, and an edge rests
            at the mean length that its triangles give it. None for the triangles of
            `rest_position`.

    Raises:
        ValueError: a triangle has no area or refers to a missing node, a node is not finite, a
            triangle is inverted, or an edge has more than two triangles.
    """
    x = np.ascontiguousarray(rest_position, dtype=np.float64)
    triangle = np.ascontiguousarray(faces, dtype=np.int32)
    n = len(x)
    _check(x, triangle)
    single = _apart(x, triangle, corners)
    gradient, double_area = _shape_gradients(single)
    area = 0.5 * double_area
    hinge, hinge_faces = _hinges(triangle)
    at_rest = x[hinge] if corners is None else _unfolded(single, triangle, hinge, hinge_faces)
    coefficient = _hinge_coefficients(at_rest)
    weight = 1.0 / (area[hinge_faces[:, 0]] + area[hinge_faces[:, 1]])
    rest = np.linalg.norm(np.einsum("hi,hij->hj", coefficient, at_rest), axis=1)

    half_edges = np.sort(_half_edges(triangle), axis=1)
    edge, of_half = np.unique(half_edges, axis=0, return_inverse=True)
    edge = edge.astype(np.int32)
    edge_length = np.linalg.norm(x[edge[:, 1]] - x[edge[:, 0]], axis=1)
    if corners is not None:
        sides = np.linalg.norm(np.roll(single, -1, axis=1) - single, axis=2).ravel()
        edge_length = np.bincount(of_half.ravel(), sides) / np.bincount(of_half.ravel())
    return Elements(
        node_count=n,
        rest_position=x,
        triangle=triangle,
        triangle_gradient=np.ascontiguousarray(gradient),
        triangle_area=area,
        hinge=hinge,
        hinge_coefficient=coefficient,
        hinge_weight=weight,
        hinge_rest=rest,
        node_area=_node_areas(triangle, area, n),
        edge=edge,
        edge_rest_length=edge_length,
        triangle_lanes=in_lanes(triangle.astype(np.uint32)),
        gradient_lanes=in_lanes(np.column_stack([gradient[:, 1], gradient[:, 2], area])),
        hinge_lanes=in_lanes(hinge.astype(np.uint32)),
        bend_lanes=in_lanes(np.column_stack([coefficient, weight, rest])),
    )


def _node_areas(triangle: IntArray, area: FloatArray, n: int) -> FloatArray:
    """Returns the area (n,) of each node, m²: a third of each of its triangles."""
    areas = np.zeros(n)
    for corner in range(3):
        np.add.at(areas, triangle[:, corner], area / 3.0)
    return areas


def _apart(x: FloatArray, triangle: IntArray, corners: FloatArray | None) -> FloatArray:
    """Returns (F,3,3) the corners of each triangle at rest, m."""
    if corners is None:
        return x[triangle]
    if corners.shape != (len(triangle), 3, 2) or not np.isfinite(corners).all():
        raise ValueError(
            f"corners have shape {corners.shape}, expected ({len(triangle)}, 3, 2), finite"
        )
    return np.concatenate([corners, np.zeros((len(triangle), 3, 1))], axis=2)


def _unfolded(
    single: FloatArray, triangle: IntArray, hinge: IntArray, hinge_faces: IntArray
) -> FloatArray:
    """Returns (H,4,3) the nodes of hinges whose two triangles lie in a plane, m."""
    flat = np.zeros((len(hinge), 4, 3))
    ends = []
    for side, sign in ((0, 1.0), (1, -1.0)):
        face = hinge_faces[:, side]
        own = [
            single[face, np.argmax(triangle[face] == hinge[:, [k]], axis=1)]
            for k in (0, 1, 2 + side)
        ]
        along = own[1] - own[0]
        length = np.linalg.norm(along, axis=1)
        ends.append(length)
        arm = own[2] - own[0]
        flat[:, 2 + side, 0] = np.einsum("ij,ij->i", arm, along) / length
        flat[:, 2 + side, 1] = sign * np.linalg.norm(np.cross(along, arm), axis=1) / length
    flat[:, 1, 0] = 0.5 * (ends[0] + ends[1])
    return flat


def _shape_gradients(corner: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns gradients of the linear shape functions (F,3,2), 1/m, and double areas (F,), m².

    Each triangle has axes of its own: the first along its first edge.

    Args:
        corner: (F,3,3) corners of the triangles, m.

    Raises:
        ValueError: a triangle has no area.
    """
    e1 = corner[:, 1] - corner[:, 0]
    e2 = corner[:, 2] - corner[:, 0]
    normal = np.cross(e1, e2)
    double_area = np.linalg.norm(normal, axis=1)
    if np.any(double_area <= 1e-14):
        raise ValueError(f"triangle {int(np.argmin(double_area))} has no area")
    u = e1 / np.linalg.norm(e1, axis=1)[:, None]
    w = np.cross(normal / double_area[:, None], u)
    edge_matrix = np.empty((len(corner), 2, 2))
    edge_matrix[:, 0, 0] = np.einsum("ij,ij->i", e1, u)
    edge_matrix[:, 1, 0] = 0.0
    edge_matrix[:, 0, 1] = np.einsum("ij,ij->i", e2, u)
    edge_matrix[:, 1, 1] = np.einsum("ij,ij->i", e2, w)
    inverse = np.linalg.inv(edge_matrix)
    gradient = np.empty((len(corner), 3, 2))
    gradient[:, 1] = inverse[:, 0]
    gradient[:, 2] = inverse[:, 1]
    gradient[:, 0] = -inverse[:, 0] - inverse[:, 1]
    return gradient, double_area


def in_lanes(rows: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Returns (k,c) rows, one per element, as (⌈k/L⌉,c,L) tiles, L = LANES, padded with zeros."""
    count, columns = rows.shape
    tiles = -(-count // LANES)
    padded = np.zeros((tiles * LANES, columns), dtype=rows.dtype)
    padded[:count] = rows
    return np.ascontiguousarray(padded.reshape(tiles, LANES, columns).transpose(0, 2, 1))


def _half_edges(triangle: IntArray) -> IntArray:
    """Returns (3F,2) the directed edges of the triangles, in each triangle's orientation."""
    return triangle[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def _check(x: FloatArray, triangle: IntArray) -> None:
    """Raises an error that names the defect of an invalid mesh."""
    n = len(x)
    if triangle.size and not 0 <= triangle.min() <= triangle.max() < n:
        wrong = int(np.flatnonzero(((triangle < 0) | (triangle >= n)).any(axis=1))[0])
        raise ValueError(
            f"triangle {wrong} has nodes {triangle[wrong].tolist()}, expected 0 to {n - 1}"
        )
    bad = np.flatnonzero(~np.isfinite(x).all(axis=1))
    if len(bad):
        raise ValueError(f"node {int(bad[0])} rests at {x[bad[0]]}, expected finite numbers")
    directed = _half_edges(triangle).astype(np.int64)
    face = np.repeat(np.arange(len(triangle)), 3)
    key = directed[:, 0] * n + directed[:, 1]
    order = np.argsort(key, kind="stable")
    twice = np.flatnonzero(key[order][1:] == key[order][:-1])
    if not len(twice):
        return
    one, other = order[twice[0]], order[twice[0] + 1]
    i, j = directed[one]
    count = int(np.count_nonzero((key == i * n + j) | (key == j * n + i)))
    if count > 2:
        raise ValueError(f"the edge of nodes {i} and {j} has {count} triangles, expected 1 or 2")
    raise ValueError(
        f"triangles {face[one]} and {face[other]} both pass from node {i} to node {j}: "
        "one of them is inverted, expected the same side of all to face outward"
    )


def _hinges(triangle: IntArray) -> tuple[IntArray, IntArray]:
    """Returns (H,4) nodes and (H,2) faces of all interior edges."""
    directed = _half_edges(triangle)
    opposite = triangle[:, [2, 0, 1]].reshape(-1)
    face = np.repeat(np.arange(len(triangle), dtype=np.int32), 3)
    key = np.sort(directed, axis=1)
    order = np.lexsort((key[:, 1], key[:, 0]))
    key, opposite, face = key[order], opposite[order], face[order]
    pair = np.flatnonzero(np.all(key[1:] == key[:-1], axis=1))
    nodes = np.column_stack([key[pair], opposite[pair], opposite[pair + 1]]).astype(np.int32)
    return np.ascontiguousarray(nodes), np.column_stack([face[pair], face[pair + 1]])


def _hinge_coefficients(hinge: FloatArray) -> FloatArray:
    """Returns (H,4) the cotangent row of Bergou et al. 2006, "A quadratic bending model".

    Args:
        hinge: (H,4,3) nodes of each hinge at rest, the shared edge first, m.
    """
    x0, x1, x2, x3 = (hinge[:, i] for i in range(4))

    def cotangent(apex: FloatArray, p: FloatArray, q: FloatArray) -> FloatArray:
        a, b = p - apex, q - apex
        cosine_part: FloatArray = np.einsum("ij,ij->i", a, b)
        return cosine_part / np.linalg.norm(np.cross(a, b), axis=1)

    c01 = cotangent(x0, x1, x2)
    c02 = cotangent(x0, x1, x3)
    c03 = cotangent(x1, x0, x2)
    c04 = cotangent(x1, x0, x3)
    return np.column_stack([c03 + c04, c01 + c02, -c01 - c03, -c02 - c04])
