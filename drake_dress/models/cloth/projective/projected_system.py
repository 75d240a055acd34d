"""Solves with a constant matrix P on the motions that contact leaves free.

The factor of P leaves out the rows of held and sticking nodes. Slipping nodes keep two directions,
which a factor cannot represent, and add the resistance c of friction to the diagonal. With slipping
nodes, conjugate gradients on Π (P + c) Π, preconditioned by Π P⁻¹ Π, replace the direct solve. They
stop early, because the fixed-point iteration corrects the remaining error.

A factor that leaves out other nodes than it should is still a preconditioner. It is renewed once it
has cost as many solves as a new one would, so that the cost is at most twice the least possible.
"""

from __future__ import annotations

import numba as nb
import numpy as np
import scipy.sparse as sp

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.factor.masked import Factor, SymbolicFactor
from drake_dress.models.cloth.filtered_cg import matrix_product, project
from drake_dress.models.cloth.matrices import Csr
from drake_dress.models.cloth.projective.iterated_contact import IteratedContact
from drake_dress.models.cloth.vectors import dot

# Relative residual at which conjugate gradients stop, and their maximum iterations.
_TOLERANCE = 0.3
_MOST_ITERATIONS = 60
# Ratio of resistance to diagonal entry above which a slipping node is left out of the factor.
_STIFF = 1.0
# Cost of a factor, in solves.
_SOLVES_PER_FACTOR = 15


class ProjectedSystem:
    """P and its factors.

    Args:
        matrix: (n,n) symmetric positive definite.

    Attributes:
        solves: number of triangular solves since `start_counting`; factors: made since then.
    """

    def __init__(self, matrix: sp.csc_matrix) -> None:
        self._symbolic = SymbolicFactor(matrix)
        self._matrix = Csr.of(matrix)
        self._diagonal = matrix.diagonal()
        self._factor: Factor | None = None
        self._excess = 0
        self.solves = 0
        self.factors = 0

    def start_counting(self) -> None:
        """Sets the counts to zero."""
        self.solves = self.factors = 0

    def go_on(self, memory: IntArray) -> None:
        """Restores the factor that was in use when `memory` (n+1,) was returned."""
        left_out = memory[1:] == 1
        if memory[0] < 0:
            self._factor = None
        elif self._factor is None or not np.array_equal(self._factor.masked, left_out):
            self._factor = self._symbolic.factorize(left_out)
        self._excess = max(0, int(memory[0]))

    def memory(self) -> IntArray:
        """Returns (n+1,) the input of `go_on`; see `ClothState.solver`."""
        found = np.full(len(self._diagonal) + 1, -1, dtype=np.int32)
        if self._factor is not None:
            found[0], found[1:] = self._excess, self._factor.masked
        return found

    def solve(self, rhs: FloatArray, contact: IteratedContact) -> FloatArray:
        """Returns z (n,3) with Π (P + c) z = Π rhs, z = Π z; exact where no node slips."""
        masked = contact.constrained() | (contact.resistance > _STIFF * self._diagonal)
        factor, exact = self._renewed(masked)
        if exact and not contact.slipping():
            self.solves += 1
            return factor.solve(rhs)
        before = self.solves
        z = self._conjugate_gradients(factor, rhs, contact)
        if not exact:
            self._excess += self.solves - before
        return z

    def _renewed(self, masked: BoolArray) -> tuple[Factor, bool]:
        """Returns a factor and whether it leaves out exactly the nodes `masked` (n,)."""
        if self._factor is not None:
            exact = np.array_equal(masked, self._factor.masked)
            if exact or self._excess < _SOLVES_PER_FACTOR:
                return self._factor, exact
        self._factor = self._symbolic.factorize(masked)
        self._excess = 0
        self.factors += 1
        return self._factor, True

    def _conjugate_gradients(
        self, factor: Factor, rhs: FloatArray, contact: IteratedContact
    ) -> FloatArray:
        mode, normal, resistance = contact.mode, contact.normal, contact.resistance
        scale = 1.0 / (self._diagonal + resistance)
        matrix = self._matrix
        z = np.zeros_like(rhs)
        residual = rhs.copy()
        project(residual, mode, normal)
        direction = np.zeros_like(rhs)
        product = np.empty_like(rhs)
        rho = first = 0.0
        for _ in range(_MOST_ITERATIONS):
            preconditioned = factor.solve(residual)
            self.solves += 1
            _fill(factor.masked, scale, residual, preconditioned)
            project(preconditioned, mode, normal)
            last, rho = rho, dot(residual, preconditioned)
            first = first or rho
            if rho <= 0.0 or (last > 0.0 and rho <= _TOLERANCE**2 * first):
                break
            _add_to(direction, rho / last if last > 0.0 else 0.0, preconditioned)
            matrix_product(matrix.indptr, matrix.indices, matrix.data, direction, product)
            _resist(resistance, direction, product)
            project(product, mode, normal)
            step = rho / dot(direction, product)
            _advance(step, direction, product, z, residual)
        return z


@nb.njit(cache=True, nogil=True)
def _fill(masked, scale, residual, out):  # type: ignore[no-untyped-def]
    for i in range(out.shape[0]):
        if masked[i]:
            for c in range(3):
                out[i, c] = scale[i] * residual[i, c]


@nb.njit(cache=True, nogil=True)
def _add_to(direction, beta, preconditioned):  # type: ignore[no-untyped-def]
    for i in range(direction.shape[0]):
        for c in range(3):
            direction[i, c] = preconditioned[i, c] + beta * direction[i, c]


@nb.njit(cache=True, nogil=True)
def _resist(resistance, direction, product):  # type: ignore[no-untyped-def]
    for i in range(direction.shape[0]):
        for c in range(3):
            product[i, c] += resistance[i] * direction[i, c]


@nb.njit(cache=True, nogil=True)
def _advance(step, direction, product, z, residual):  # type: ignore[no-untyped-def]
    for i in range(direction.shape[0]):
        for c in range(3):
            z[i, c] += step * direction[i, c]
            residual[i, c] -= step * product[i, c]
