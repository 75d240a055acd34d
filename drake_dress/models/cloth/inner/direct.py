"""A = M + h² K₊, solved by a direct factor: the limit of the iterations, for tests and studies."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from drake_dress.models.cloth.elements import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.filtered_cg import SLIP, STICK
from drake_dress.models.cloth.inner.conjugate_gradients import Solved
from drake_dress.models.cloth.inner.filtered import Filtered
from drake_dress.models.cloth.inner.interface import directions_of_exact
from drake_dress.models.cloth.inner.oblique import hold_obliquely


class Direct:
    """The limit; see `InnerIteration`.

    Args:
        matrix: A(x).
        p: (n,n) P, for its size.
        held: (k,) nodes with prescribed motion.
    """

    depends_on_position = True

    def __init__(self, matrix: Filtered, p: sp.csc_matrix, held: IntArray) -> None:
        self.matrix = matrix
        self.held = held
        self.node_count = p.shape[0]
        self.system = matrix.system(p)

    def derivative(self, x: FloatArray, w: FloatArray, z: FloatArray) -> FloatArray:
        """Returns ∂(wᵀ A(x) z)/∂x (n,3)."""
        return self.matrix.derivative(x, w, z)

    def at(self, x: FloatArray) -> DirectSystem:
        """Returns the system at positions `x` (n,3), m."""
        return DirectSystem(self, self.matrix.block(x))


class DirectSystem:
    """(M + h² K₊) z = rhs of one step; see `StepSystem`."""

    def __init__(self, scheme: Direct, block: FloatArray) -> None:
        self._scheme = scheme
        self._block = block
        self._nodes = np.zeros(0, dtype=np.int32)
        self._matrix = scheme.matrix.assemble(block)
        self._factors: dict[tuple[bytes, bytes, bytes], tuple[sp.csc_matrix, spla.SuperLU]] = {}

    def start(
        self, motion: tuple[FloatArray, FloatArray], change: tuple[FloatArray, FloatArray]
    ) -> tuple[Solved, Solved]:
        """See `StepSystem`."""
        return self._free(*motion), self._free(*change)

    def touch(self, nodes: IntArray) -> None:
        """See `StepSystem`."""
        self._nodes = nodes

    def hold(
        self,
        unknown: Solved,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
        push: FloatArray | None = None,
        guess: FloatArray | None = None,
        backward: bool = False,
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`; there is nothing to guess."""

        def plain(target: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
            return self._hold(unknown, mode, normal, target, force)

        force, z, unknown.multiplier = hold_obliquely(
            plain, mode, normal, target, push, backward, 1e-13
        )
        return force, z

    def finish(
        self, motion: Solved, change: Solved, less: Solved | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`."""
        return (motion.z if less is None else motion.z - less.z), change.z

    def blank(self) -> Solved:
        """See `StepSystem`."""
        zero = np.zeros((self._scheme.node_count, 3))
        return Solved(zero, np.zeros((len(self._scheme.held), 3)), zero, zero)

    def by_directions(
        self, forward: Solved, backward: Solved, target: FloatArray, slip: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`."""
        assert forward.multiplier is not None and backward.multiplier is not None
        nodes = self._nodes
        return directions_of_exact(
            forward.multiplier,
            forward.z[nodes],
            backward.multiplier,
            backward.z[nodes],
            target,
            slip,
        )

    def again(self, unknown: Solved) -> Solved:
        """See `StepSystem`."""
        return Solved(unknown.rhs, unknown.held, unknown.free, unknown.z)

    def pairs(self, forward: Solved, backward: Solved) -> list[tuple[FloatArray, FloatArray]]:
        """See `StepSystem`."""
        return [(backward.z, forward.z)]

    def by_parameter(self, name: str, forward: Solved, backward: Solved) -> float:
        """See `StepSystem`."""
        pairs = self.pairs(forward, backward)
        change = -sum(float(np.sum(w * self.share(name, z))) for w, z in pairs)
        return change

    def share(self, name: str, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        return self._scheme.matrix.share(name, self._block, z)

    def product(self, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        return self._scheme.system.product(z, self._block)

    def held_rows(self, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        rows: FloatArray = self.product(z)[self._scheme.held]
        return rows

    def _hold(
        self,
        unknown: Solved,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
        force: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Binds without friction; returns what binds and z at the nodes."""
        nodes, scheme = self._nodes, self._scheme
        rhs = unknown.rhs.copy()
        rhs[nodes] += force
        slip, stick = mode == SLIP, mode == STICK
        fixed = np.zeros_like(rhs)
        fixed[scheme.held] = unknown.held
        fixed[nodes[stick]] = target[stick]
        n = normal[slip]
        fixed[nodes[slip]] = np.einsum("ij,ij->i", target[slip], n)[:, None] * n
        unknown.z = self._solve(rhs, fixed, nodes[stick], nodes[slip], n)
        binding = (self.product(unknown.z) - rhs)[nodes]
        binding[slip] = np.einsum("ij,ij->i", binding[slip], n)[:, None] * n
        binding[~(stick | slip)] = 0.0
        return binding, unknown.z[nodes]

    def _free(self, rhs: FloatArray, held: FloatArray) -> Solved:
        fixed = np.zeros_like(rhs)
        fixed[self._scheme.held] = held
        none = np.zeros(0, dtype=np.int32)
        z = self._solve(rhs, fixed, none, none, np.zeros((0, 3)))
        return Solved(rhs, held, z, z)

    def _solve(
        self,
        rhs: FloatArray,
        fixed: FloatArray,
        stick: IntArray,
        slip: IntArray,
        normal: FloatArray,
    ) -> FloatArray:
        """Solves on the rows that are free: all of a node, or two tangents of one that slips."""
        key = (stick.tobytes(), slip.tobytes(), normal.tobytes())
        if key not in self._factors:
            basis = self._free_rows(stick, slip, normal)
            self._factors[key] = basis, spla.splu(sp.csc_matrix(basis.T @ self._matrix @ basis))
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
        # Two columns of the Householder reflection that turns the normal to an axis.
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
