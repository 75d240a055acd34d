"""A = M + h² K₊, by conjugate gradients with the factor of P as preconditioner.

One iteration with P resists rotation as if it were stretch; A does not. Few iterations are enough
(benchmarks/cloth), and the scheme stays bounded because K₊ is positive semi-definite. The map from
rhs to z is symmetric up to the tolerance of the solver, so the adjoint is another solve.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.modes import HELD, SLIP, STICK
from drake_dress.models.cloth.explicit.inner.filtered import Filtered
from drake_dress.models.cloth.explicit.inner.solved import FilteredScheme, FilteredSystem, Solved
from drake_dress.models.cloth.factor.masked import Factor, SymbolicFactor
from drake_dress.models.cloth.filtered_cg import Bound, Preconditioner, Stop


class ConjugateGradients(FilteredScheme):
    """The accelerated scheme; see `InnerIteration`.

    Args:
        matrix: A(x).
        p: (n,n) P.
        held: (k,) nodes with prescribed motion.
        tolerance: relative residual, in the preconditioner's norm, at which iterations stop.
        max_iterations: upper limit of iterations per solve.
    """

    def __init__(
        self,
        matrix: Filtered,
        p: sp.csc_matrix,
        held: IntArray,
        tolerance: float,
        max_iterations: int,
    ) -> None:
        super().__init__(matrix, p, held, tolerance)
        self.max_iterations = max_iterations
        self.symbolic = SymbolicFactor(p)
        self.masked = np.zeros(self.node_count, dtype=np.bool_)
        self.masked[held] = True
        self.held_factor = self.symbolic.factorize(self.masked)

    def at(self, x: FloatArray) -> ConjugateGradientSystem:
        """Returns the system at positions `x` (n,3), m."""
        return ConjugateGradientSystem(self, self.matrix.block(x))


class ConjugateGradientSystem(FilteredSystem):
    """(M + h² K₊) z = rhs of one step; see `StepSystem`."""

    def __init__(self, scheme: ConjugateGradients, block: FloatArray) -> None:
        super().__init__(scheme, block)
        self._scheme = scheme
        self._factor: Factor = scheme.held_factor

    def touch(self, nodes: IntArray) -> None:
        """See `StepSystem`."""
        super().touch(nodes)
        masked = self._scheme.masked.copy()
        masked[nodes] = True
        self._factor = self._scheme.symbolic.factorize(masked)

    def start(
        self,
        motion: tuple[FloatArray, FloatArray],
        change: tuple[FloatArray, FloatArray],
        guess: FloatArray | None = None,
    ) -> tuple[Solved, Solved]:
        """See `StepSystem`."""
        s = self._scheme
        first = np.zeros_like(motion[0]) if guess is None else guess.copy()
        second = np.zeros_like(first)
        first[s.held], second[s.held] = motion[1], change[1]
        iterations = s.system.solve_pair(
            s.held_factor,
            self._block,
            (motion[0], change[0]),
            (first, second),
            s.tolerance,
            s.max_iterations,
        )
        self.iterations += sum(iterations)
        return Solved(*motion, first, first), Solved(*change, second, second)

    def _bind(
        self,
        unknown: Solved,
        rhs: FloatArray,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
    ) -> FloatArray:
        """Warm starts from the unknown's last solution."""
        nodes = self._nodes
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
        s, product = self._scheme, np.empty_like(z)
        iterations, _ = s.system.solve(
            Preconditioner(self._factor),
            self._block,
            Bound(modes, normals),
            rhs,
            z,
            Stop(s.tolerance, s.max_iterations),
            product,
        )
        self.iterations += iterations
        unknown.z = z
        return product
