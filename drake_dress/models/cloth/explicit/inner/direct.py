"""A = M + h² K₊, solved by a direct factor: the limit of the iterations, for tests and studies."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.modes import SLIP, STICK
from drake_dress.models.cloth.explicit.inner.filtered import Filtered
from drake_dress.models.cloth.explicit.inner.solved import FilteredScheme, FilteredSystem, Solved

# Tolerance of passes with friction; the solves themselves are exact.
_TOLERANCE = 1e-13


class Direct(FilteredScheme):
    """The limit of the iterations; see `InnerIteration`.

    Args:
        matrix: A(x).
        p: (n,n) P; only its size matters.
        held: (k,) nodes with prescribed motion.
    """

    def __init__(self, matrix: Filtered, p: sp.csc_matrix, held: IntArray) -> None:
        super().__init__(matrix, p, held, _TOLERANCE)

    def at(self, x: FloatArray) -> DirectSystem:
        """Returns the system at positions `x` (n,3), m."""
        return DirectSystem(self, self.matrix.block(x))


class DirectSystem(FilteredSystem):
    """(M + h² K₊) z = rhs of one step; see `StepSystem`."""

    def __init__(self, scheme: Direct, block: FloatArray) -> None:
        super().__init__(scheme, block)
        self._scheme = scheme
        self._matrix = scheme.matrix.assemble(block)
        self._factors: dict[tuple[bytes, bytes, bytes], tuple[sp.csc_matrix, spla.SuperLU]] = {}

    def start(
        self,
        motion: tuple[FloatArray, FloatArray],
        change: tuple[FloatArray, FloatArray],
        guess: FloatArray | None = None,
    ) -> tuple[Solved, Solved]:
        """See `StepSystem`; `guess` is not used."""
        return self._free(*motion), self._free(*change)

    def _free(self, rhs: FloatArray, held: FloatArray) -> Solved:
        fixed = np.zeros_like(rhs)
        fixed[self._scheme.held] = held
        none = np.zeros(0, dtype=np.int32)
        z = self._solve(rhs, fixed, none, none, np.zeros((0, 3)))
        return Solved(rhs, held, z, z)

    def _bind(
        self,
        unknown: Solved,
        rhs: FloatArray,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
    ) -> FloatArray:
        stick, slip = mode == STICK, mode == SLIP
        fixed = self._prescribed(unknown.held, mode, normal, target)
        unknown.z = self._solve(rhs, fixed, self._nodes[stick], self._nodes[slip], normal[slip])
        return self.product(unknown.z)

    def _solve(
        self,
        rhs: FloatArray,
        fixed: FloatArray,
        stick: IntArray,
        slip: IntArray,
        normal: FloatArray,
    ) -> FloatArray:
        """Solves on the free rows: all three of a free node, two tangents of a slipping one."""
        key = (stick.tobytes(), slip.tobytes(), normal.tobytes())
        if key not in self._factors:
            basis = self._free_rows(stick, slip, normal)
            self._factors[key] = basis, spla.splu(sp.csc_matrix(basis.T @ self._matrix @ basis))
        self.iterations += 1
        basis, factor = self._factors[key]
        inner = factor.solve(basis.T @ (rhs.ravel() - self._matrix @ fixed.ravel()))
        z: FloatArray = fixed + (basis @ inner).reshape(-1, 3)
        return z

    def _free_rows(self, stick: IntArray, slip: IntArray, normal: FloatArray) -> sp.csc_matrix:
        count = self._scheme.node_count
        bound = np.zeros(count, dtype=np.bool_)
        bound[self._scheme.held] = True
        bound[stick] = True
        bound[slip] = True
        free = np.flatnonzero(~bound)
        row = (3 * free[:, None] + np.arange(3)).ravel()
        column = np.arange(len(row))
        value = np.ones(len(row))
        # Two columns of the Householder reflection that maps the normal to an axis.
        helper = normal.copy()
        sign = np.where(normal[:, 2] >= 0.0, 1.0, -1.0)
        helper[:, 2] += sign
        scale = 2.0 / np.sum(helper**2, axis=1)
        for axis in (0, 1):
            tangent = -(scale * helper[:, axis])[:, None] * helper
            tangent[:, axis] += 1.0
            first = len(row) and column.max() + 1
            row = np.concatenate([row, (3 * slip[:, None] + np.arange(3)).ravel()])
            column = np.concatenate([column, np.repeat(first + np.arange(len(slip)), 3)])
            value = np.concatenate([value, tangent.ravel()])
        size = int(column.max()) + 1
        return sp.csc_matrix((value, (row, column)), shape=(3 * count, size))
