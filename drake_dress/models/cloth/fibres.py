"""Fibres: additional stiffness of each triangle along one direction, such as warp or weft.

A fibre of direction d (rest frame of the triangle) is stretched to λ = ‖F d‖ and stores
½ k A (λ − 1)², A the rest area. F d = Σ c_i x_i over the corners, c_i = g_i · d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
import scipy.sparse as sp

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements

# Stretch below which a crushed fibre has no direction.
_SHORTEST = 1e-3


@dataclass(frozen=True)
class Fibres:
    """One fibre per triangle.

    Attributes:
        triangle: (F,3) node indices.
        coefficient: (F,3) c_i, 1/m.
        weight: (F,) k A, N m.
    """

    triangle: IntArray
    coefficient: FloatArray
    weight: FloatArray

    @staticmethod
    def along(
        elements: Elements, rest_position: FloatArray, direction: FloatArray, stiffness: float
    ) -> Fibres:
        """Returns fibres along `direction` (F,3), each projected into its triangle's plane.

        A triangle whose plane is normal to the direction gets no fibre.

        Args:
            elements: the rest shape.
            rest_position: (n,3) positions from which `elements` was made, m.
            direction: (F,3) of any length, in the frame of `rest_position`.
            stiffness: k, N/m.
        """
        t, g = elements.triangle, elements.triangle_gradient
        # columns of the triangle's frame: x_i = u p_i + w q_i, so Σ g_i x_iᵀ has rows u and w
        frame = np.einsum("eia,eic->eac", g, rest_position[t])
        in_plane = np.einsum("eac,ec->ea", frame, direction)
        length = np.linalg.norm(in_plane, axis=1)
        lies = length > 1e-6 * np.maximum(np.linalg.norm(direction, axis=1), 1e-300)
        unit = in_plane / np.where(lies, length, 1.0)[:, None]
        return Fibres(
            t,
            np.ascontiguousarray(np.einsum("eia,ea->ei", g, unit)),
            np.where(lies, stiffness * elements.triangle_area, 0.0),
        )

    def energy(self, x: FloatArray) -> float:
        """Returns the energy, J, of positions `x` (n,3), m."""
        along = np.einsum("ei,eic->ec", self.coefficient, x[self.triangle])
        return float(0.5 * np.sum(self.weight * (np.linalg.norm(along, axis=1) - 1.0) ** 2))

    def add_force(self, x: FloatArray, force: FloatArray) -> None:
        """Adds the force on the nodes, −∂energy/∂x, to `force` (n,3), N."""
        _add_force(x, self.triangle, self.coefficient, self.weight, force)

    def prepare(self, x: FloatArray) -> FloatArray:
        """Returns (F,4) direction of the fibres at `x` (n,3) and their lateral stiffness share.

        Data for `filtered_product`. Compressed fibres have no lateral stiffness.
        """
        block = np.empty((len(self.weight), 4))
        _prepare(x, self.triangle, self.coefficient, block)
        return block

    def matrix(self, node_count: int) -> sp.csc_matrix:
        """Returns Σ w AᵀA (n,n), N/m, an upper bound of the stiffness."""
        local = np.einsum("e,ei,ej->eij", self.weight, self.coefficient, self.coefficient)
        row = np.repeat(self.triangle, 3, axis=1).ravel()
        column = np.tile(self.triangle, (1, 3)).ravel()
        shape = (node_count, node_count)
        return sp.csc_matrix((local.ravel(), (row, column)), shape=shape)


def no_fibres() -> Fibres:
    """Returns an empty set of fibres."""
    return Fibres(np.zeros((0, 3), dtype=np.int32), np.zeros((0, 3)), np.zeros(0))


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _stretched(x, triangle, coefficient, e):  # type: ignore[no-untyped-def]
    i, j, k = triangle[e, 0], triangle[e, 1], triangle[e, 2]
    a, b, c = coefficient[e, 0], coefficient[e, 1], coefficient[e, 2]
    s0 = a * x[i, 0] + b * x[j, 0] + c * x[k, 0]
    s1 = a * x[i, 1] + b * x[j, 1] + c * x[k, 1]
    s2 = a * x[i, 2] + b * x[j, 2] + c * x[k, 2]
    return s0, s1, s2


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _add_force(x, triangle, coefficient, weight, force):  # type: ignore[no-untyped-def]
    for e in range(triangle.shape[0]):
        s0, s1, s2 = _stretched(x, triangle, coefficient, e)
        length = max(np.sqrt(s0 * s0 + s1 * s1 + s2 * s2), _SHORTEST)
        pull = -weight[e] * (1.0 - 1.0 / length)
        for q in range(3):
            node, share = triangle[e, q], pull * coefficient[e, q]
            force[node, 0] += share * s0
            force[node, 1] += share * s1
            force[node, 2] += share * s2


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _prepare(x, triangle, coefficient, block):  # type: ignore[no-untyped-def]
    for e in range(triangle.shape[0]):
        s0, s1, s2 = _stretched(x, triangle, coefficient, e)
        length = max(np.sqrt(s0 * s0 + s1 * s1 + s2 * s2), _SHORTEST)
        block[e, 0], block[e, 1], block[e, 2] = s0 / length, s1 / length, s2 / length
        block[e, 3] = max(0.0, 1.0 - 1.0 / length)


@nb.njit(cache=True, nogil=True, fastmath=True, error_model="numpy", forceinline=True)
def filtered_product(z, triangle, coefficient, weight, block, scale, product):  # type: ignore[no-untyped-def]
    """Adds scale · K₊ z to `product` (n,3), K₊ the stiffness less that of compressed fibres."""
    for e in range(block.shape[0]):
        s0, s1, s2 = _stretched(z, triangle, coefficient, e)
        n0, n1, n2, lateral = block[e, 0], block[e, 1], block[e, 2], block[e, 3]
        along = (1.0 - lateral) * (n0 * s0 + n1 * s1 + n2 * s2)
        w = scale * weight[e]
        s0 = w * (along * n0 + lateral * s0)
        s1 = w * (along * n1 + lateral * s1)
        s2 = w * (along * n2 + lateral * s2)
        for q in range(3):
            node, share = triangle[e, q], coefficient[e, q]
            product[node, 0] += share * s0
            product[node, 1] += share * s1
            product[node, 2] += share * s2
