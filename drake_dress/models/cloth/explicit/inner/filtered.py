"""A = M + h² K₊, the system of all schemes except `OneStep`.

K₊ is the positive semi-definite part of the stretch stiffness at the positions of the step, plus
the exact bending of a flat garment. P bounds A from above.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.filtered_cg import SystemMatrix, matrix_product
from drake_dress.models.cloth.filtered_stiffness import (
    filtered_derivative,
    filtered_product,
    prepare_filtered,
)
from drake_dress.models.cloth.matrices import Csr


class Filtered:
    """The matrix A(x).

    Args:
        elements: the rest shape.
        stretch: stretch stiffness, N/m.
        time_step: h, s.
        linear: (n,n) the part that is the same at all positions: mass and bending.
        bending: (n,n) its derivative by the bending stiffness.
    """

    def __init__(
        self,
        elements: Elements,
        stretch: float,
        time_step: float,
        linear: sp.csc_matrix,
        bending: sp.csc_matrix,
    ) -> None:
        self.elements = elements
        self.stretch = stretch
        self.scale = time_step**2
        self.linear = sp.csc_matrix(linear)
        self._bending = Csr.of(bending)
        self._area = elements.node_area

    def system(self, p: sp.csc_matrix) -> SystemMatrix:
        """Returns A with its solver; the factor of `p` (n,n) is the preconditioner."""
        return SystemMatrix(Csr.of(self.linear), 1.0 / p.diagonal(), self.elements, self.scale)

    def assemble(self, block: FloatArray) -> sp.csc_matrix:
        """Returns A as a (3n,3n) matrix, rows in the order node, axis; slow, for studies."""
        e = self.elements
        r = block.transpose(0, 2, 1).reshape(-1, block.shape[1])[: len(e.triangle)]
        rotation, n = r[:, :6].reshape(-1, 3, 2), r[:, 6:9]
        inverse = np.stack([r[:, 9:11], r[:, 10:12]], axis=1)
        turn = np.stack([-rotation[:, :, 1], rotation[:, :, 0]], axis=2)
        # dF ↦ w dF − spin · turn − n ⊗ S⁻¹(nᵀ dF), as a (3·2, 3·2) matrix
        stiffness = np.einsum("e,ij,ab->eiajb", r[:, 13], np.eye(3), np.eye(2))
        stiffness -= np.einsum("e,eia,ejb->eiajb", r[:, 12], turn, turn)
        stiffness -= np.einsum("ei,ej,eab->eiajb", n, n, inverse)
        g = e.triangle_gradient
        local = self.scale * np.einsum("epa,eiajb,eqb->epiqj", g, stiffness, g)
        index = (3 * e.triangle[:, :, None] + np.arange(3)).reshape(-1, 9)
        size = 3 * e.node_count
        shape = (np.repeat(index, 9, axis=1).ravel(), np.tile(index, (1, 9)).ravel())
        stretch = sp.csc_matrix((local.ravel(), shape), shape=(size, size))
        return sp.csc_matrix(stretch + sp.kron(self.linear, sp.eye(3)))

    def block(self, x: FloatArray) -> FloatArray:
        """Returns the data that depends on the positions `x` (n,3), m."""
        return prepare_filtered(self.elements, self.stretch, x)

    def derivative(self, x: FloatArray, w: FloatArray, z: FloatArray) -> FloatArray:
        """Returns ∂(wᵀ A(x) z)/∂x (n,3)."""
        return self.scale * filtered_derivative(self.elements, self.stretch, x, w, z)

    def share(self, name: str, block: FloatArray, z: FloatArray) -> FloatArray:
        """Returns ∂A/∂θ z (n,3), θ the value of `Material` with this name."""
        out = np.zeros_like(z)
        if name == "surface_density":
            out += self._area[:, None] * z
        elif name == "stretch_stiffness":
            e = self.elements
            scale = self.scale / self.stretch
            filtered_product(z, e.triangle_lanes, e.gradient_lanes, block, scale, out)
        else:
            m = self._bending
            matrix_product(m.indptr, m.indices, m.data, z, out)
        return out
