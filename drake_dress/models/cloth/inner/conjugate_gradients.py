"""A = M + h² K₊, by conjugate gradients with the factor of P as preconditioner.

One iteration with P resists rotation as if it were stretch; A does not. Few iterations are enough
(benchmarks/cloth), and the scheme stays bounded because K₊ is positive semi-definite. Solved to a
tolerance, the map from rhs to z is symmetric up to that tolerance, so the adjoint is another solve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from drake_dress.models.cloth.elements import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.factor import Factor, SymbolicFactor
from drake_dress.models.cloth.filtered_cg import HELD, SLIP, STICK
from drake_dress.models.cloth.inner.filtered import Filtered
from drake_dress.models.cloth.inner.interface import directions_of_exact
from drake_dress.models.cloth.inner.oblique import hold_obliquely


@dataclass
class Solved:
    """An unknown with its right-hand side (n,3), held values (k,3) and solution (n,3).

    `multiplier` (c,) is what binds nodes in contact along their normals.
    """

    rhs: FloatArray
    held: FloatArray
    free: FloatArray
    z: FloatArray
    multiplier: FloatArray | None = None


class ConjugateGradients:
    """The accelerated scheme; see `InnerIteration`.

    Args:
        matrix: A(x).
        p: (n,n) P.
        held: (k,) nodes with prescribed motion.
        tolerance: relative residual, in the preconditioner's norm, at which iterations stop.
        max_iterations: of conjugate gradients for each solve.
    """

    depends_on_position = True

    def __init__(
        self,
        matrix: Filtered,
        p: sp.csc_matrix,
        held: IntArray,
        tolerance: float,
        max_iterations: int,
    ) -> None:
        n = p.shape[0]
        self.matrix = matrix
        self.held = held
        self.tolerance = tolerance
        self.max_iterations = max_iterations
        self.symbolic = SymbolicFactor(p)
        self.masked = np.zeros(n, dtype=np.bool_)
        self.masked[held] = True
        self.held_factor = self.symbolic.factorize(self.masked)
        self.system = matrix.system(p)

    def derivative(self, x: FloatArray, w: FloatArray, z: FloatArray) -> FloatArray:
        """Returns ∂(wᵀ A(x) z)/∂x (n,3)."""
        return self.matrix.derivative(x, w, z)

    def at(self, x: FloatArray) -> ConjugateGradientSystem:
        """Returns the system at positions `x` (n,3), m."""
        return ConjugateGradientSystem(self, self.matrix.block(x))


class ConjugateGradientSystem:
    """(M + h² K₊) z = rhs of one step; see `StepSystem`."""

    def __init__(self, scheme: ConjugateGradients, block: FloatArray) -> None:
        self._scheme = scheme
        self._block = block
        self._factor: Factor = scheme.held_factor
        self._nodes = np.zeros(0, dtype=np.int32)
        self.iterations = 0

    def start(
        self, motion: tuple[FloatArray, FloatArray], change: tuple[FloatArray, FloatArray]
    ) -> tuple[Solved, Solved]:
        """See `StepSystem`."""
        return self._free(*motion), self._free(*change)

    def touch(self, nodes: IntArray) -> None:
        """See `StepSystem`."""
        self._nodes = nodes
        masked = self._scheme.masked.copy()
        masked[nodes] = True
        self._factor = self._scheme.symbolic.factorize(masked)

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
            plain, mode, normal, target, push, backward, self._scheme.tolerance
        )
        return force, z

    def finish(
        self, motion: Solved, change: Solved, less: Solved | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`."""
        return (motion.z if less is None else motion.z - less.z), change.z

    def blank(self) -> Solved:
        """See `StepSystem`."""
        zero = np.zeros((len(self._scheme.masked), 3))
        return Solved(zero, np.zeros((len(self._scheme.held), 3)), zero, zero)

    def pairs(self, forward: Solved, backward: Solved) -> list[tuple[FloatArray, FloatArray]]:
        """See `StepSystem`."""
        return [(backward.z, forward.z)]

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
        nodes = self._nodes
        rhs = unknown.rhs.copy()
        rhs[nodes] += force
        z = unknown.z.copy()
        stick, slip = mode == STICK, mode == SLIP
        z[nodes[stick]] = target[stick]
        n = normal[slip]
        lack = np.einsum("ij,ij->i", target[slip] - z[nodes[slip]], n)
        z[nodes[slip]] += lack[:, None] * n
        modes = np.zeros(len(z), dtype=np.int32)
        modes[nodes] = mode
        modes[self._scheme.held] = HELD
        normals = np.zeros_like(z)
        normals[nodes] = normal
        self._solve(self._factor, modes, normals, rhs, z)
        unknown.z = z
        binding = (self.product(z) - rhs)[nodes]
        binding[slip] = np.einsum("ij,ij->i", binding[slip], n)[:, None] * n
        binding[~(stick | slip)] = 0.0
        return binding, z[nodes]

    def _free(self, rhs: FloatArray, held: FloatArray) -> Solved:
        z = np.zeros_like(rhs)
        z[self._scheme.held] = held
        modes = np.where(self._scheme.masked, HELD, 0).astype(np.int32)
        self._solve(self._scheme.held_factor, modes, z, rhs, z)
        return Solved(rhs, held, z, z)

    def _solve(
        self, factor: Factor, modes: IntArray, normals: FloatArray, rhs: FloatArray, z: FloatArray
    ) -> None:
        s = self._scheme
        iterations, _ = s.system.solve(
            factor, self._block, modes, normals, rhs, z, s.tolerance, s.max_iterations
        )
        self.iterations += iterations
