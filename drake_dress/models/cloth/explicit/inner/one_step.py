"""A = P: the paper's scheme with one iteration, solved exactly, contact included.

P = M + h² Σ w AᵀA never changes, so its factor without the grippers' nodes is made once. Contact
adds unknown forces λ at its nodes. Their motion is E z_free + S λ, S = E P⁻¹ Eᵀ: P_ic⁻¹ of the
paper, which is never formed. Conjugate gradients find λ (GMRES with friction). S is applied by the
few columns of the factor that the contact nodes reach; the sparse block P_cc is the preconditioner.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.contact.modes import SLIP, STICK
from drake_dress.models.cloth.explicit.inner.binding import (
    bind,
    by_all,
    by_neighbours,
    product_rows,
    subtract_columns,
)
from drake_dress.models.cloth.explicit.inner.interface import directions_of_exact
from drake_dress.models.cloth.factor.masked import Factor, SymbolicFactor
from drake_dress.models.cloth.filtered_cg import matrix_product
from drake_dress.models.cloth.matrices import Csr

# Number of contacts above which a separate factor costs less than iterations, and of slipping nodes
# above which another factor is the cheaper preconditioner, measured at 6,000 nodes.
MANY, MANY_SLIPPING = 1500, 1500
_NO_NODES = np.zeros(0, dtype=np.int32)
_NO_PUSH = np.zeros((0, 3))


@dataclass
class ForcedUnknown:
    """Solution without contact (n,3), and how contact changes it.

    If nodes are bound: the forces (c,3) on them, their normal forces ν (c,), the solution at the
    nodes (c,3), and the change of the solution everywhere (n,3), if known.
    """

    free: FloatArray
    force: FloatArray | None = None
    multiplier: FloatArray | None = None
    at_nodes: FloatArray | None = None
    change: FloatArray | None = None


class OneStep:
    """The scheme with one iteration; see `InnerIteration`.

    Args:
        p: (n,n) P, symmetric positive definite.
        shares: its derivatives by values of `Material`, by name.
        held: (k,) nodes with prescribed motion.
        tolerance: of the motion of nodes in contact, relative to how far contact moves them.
        max_iterations: upper limit for conjugate gradients and for GMRES.
        many: number of contacts above which a separate factor leaves out the sticking nodes.
        many_slipping: number of slipping nodes above which a factor without them preconditions.
    """

    depends_on_position = False

    def __init__(
        self,
        p: sp.csc_matrix,
        shares: dict[str, sp.csc_matrix],
        held: IntArray,
        tolerance: float,
        max_iterations: int = 300,
        many: int = MANY,
        many_slipping: int = MANY_SLIPPING,
    ) -> None:
        n = p.shape[0]
        masked = np.zeros(n, dtype=np.bool_)
        masked[held] = True
        self.matrix = Csr.of(p)
        self.shares = {name: Csr.of(share) for name, share in shares.items()}
        self.held = held
        self.masked = masked
        self.symbolic = SymbolicFactor(p)
        self.factor: Factor = self.symbolic.factorize(masked)
        self.many = many
        self.many_slipping = many_slipping
        self.tolerance = tolerance
        self.max_iterations = max_iterations
        self.node_count = n

    def derivative(self, x: FloatArray, w: FloatArray, z: FloatArray) -> FloatArray:
        """Returns zero (n,3): P does not depend on positions."""
        return np.zeros_like(x)

    def at(self, x: FloatArray) -> OneStepSystem:
        """Returns the system; it is the same for all positions (n,3)."""
        return OneStepSystem(self)


class OneStepSystem:
    """P z = rhs of one step; see `StepSystem`."""

    def __init__(self, scheme: OneStep) -> None:
        self._scheme = scheme
        self._nodes = _NO_NODES
        self._factors: dict[bytes, Factor] = {}
        self.iterations = 0

    def start(
        self,
        motion: tuple[FloatArray, FloatArray],
        change: tuple[FloatArray, FloatArray],
        guess: FloatArray | None = None,
    ) -> tuple[ForcedUnknown, ForcedUnknown]:
        """See `StepSystem`; `guess` is not used."""
        s, m = self._scheme, self._scheme.matrix
        rhs = []
        for right, held in (motion, change):
            r = right.copy()
            subtract_columns(m.indptr, m.indices, m.data, s.held, held, r)
            rhs.append(r)
        first, second = s.factor.solve_pair(*rhs)
        first[s.held] = motion[1]
        second[s.held] = change[1]
        return ForcedUnknown(first), ForcedUnknown(second)

    def touch(self, nodes: IntArray) -> None:
        """See `StepSystem`."""
        s = self._scheme
        self._nodes = nodes
        if len(nodes) <= s.many:
            self._part = s.factor.part(nodes)
            self._conditioner = by_neighbours(s.matrix, s.factor, nodes)

    def hold(
        self,
        unknown: ForcedUnknown,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
        push: FloatArray | None = None,
        guess: FloatArray | None = None,
        backward: bool = False,
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`."""
        s = self._scheme
        if len(self._nodes) > s.many:
            return self._hold_many(unknown, mode, normal, target, push, backward)
        free = unknown.free[self._nodes]
        unknown.force, moved, unknown.multiplier, iterations = bind(
            self._part,
            self._conditioner,
            mode,
            normal,
            _NO_PUSH if push is None else push,
            backward,
            target - free,
            _NO_PUSH if guess is None else guess,
            s.tolerance,
            s.max_iterations,
        )
        self.iterations += iterations
        unknown.at_nodes, unknown.change = free + moved, None
        return unknown.force, unknown.at_nodes

    def _hold_many(
        self,
        unknown: ForcedUnknown,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
        push: FloatArray | None,
        backward: bool,
    ) -> tuple[FloatArray, FloatArray]:
        """Does the same with a factor that leaves the sticking nodes out.

        It solves for the correction y of the free solution: P y is zero except at bound nodes.
        """
        s, m, nodes = self._scheme, self._scheme.matrix, self._nodes
        stick, slip = np.flatnonzero(mode == STICK), np.flatnonzero(mode == SLIP)
        factor = self._factor_without(nodes[stick])
        free = unknown.free[nodes]
        lack = target - free
        rhs = np.zeros_like(unknown.free)
        subtract_columns(m.indptr, m.indices, m.data, nodes[stick], lack[stick], rhs)
        correction = factor.solve(rhs)
        correction[nodes[stick]] = lack[stick]
        force = np.zeros_like(lack)
        multiplier = np.zeros(len(nodes))
        if len(slip):
            sliding = nodes[slip]
            if len(slip) > s.many_slipping:
                bound_nodes = nodes[(mode == STICK) | (mode == SLIP)]
                conditioner = by_all(m, self._factor_without(bound_nodes), sliding)
            else:
                conditioner = by_neighbours(m, factor, sliding)
            bound, _, multiplier[slip], iterations = bind(
                factor.part(sliding),
                conditioner,
                mode[slip],
                normal[slip],
                _NO_PUSH if push is None else push[slip],
                backward,
                lack[slip] - correction[sliding],
                _NO_PUSH,
                s.tolerance,
                s.max_iterations,
            )
            self.iterations += iterations
            force[slip] = bound
            rhs = np.zeros_like(rhs)
            rhs[sliding] = bound
            correction += factor.solve(rhs)
        rows = np.empty((len(stick), 3))
        product_rows(m.indptr, m.indices, m.data, nodes[stick], correction, rows)
        force[stick] = rows
        multiplier[stick] = np.einsum("ij,ij->i", rows, normal[stick])
        unknown.force, unknown.multiplier, unknown.change = force, multiplier, correction
        unknown.at_nodes = free + correction[nodes]
        return force, unknown.at_nodes

    def _factor_without(self, nodes: IntArray) -> Factor:
        """Returns the factor of P without held and given nodes; cached for the step."""
        if not len(nodes):
            return self._scheme.factor
        key = nodes.tobytes()
        if key not in self._factors:
            masked = self._scheme.masked.copy()
            masked[nodes] = True
            self._factors[key] = self._scheme.symbolic.factorize(masked)
        return self._factors[key]

    def finish(
        self, motion: ForcedUnknown, change: ForcedUnknown, less: ForcedUnknown | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`."""
        if not len(self._nodes):
            return motion.free, change.free
        first, second = motion.free.copy(), change.free.copy()
        rhs = np.zeros_like(first), np.zeros_like(second)
        unsolved = False
        for unknown, place, sign in ((motion, 0, 1.0), (less, 0, -1.0), (change, 1, 1.0)):
            if unknown is None or unknown.force is None:
                continue
            if unknown.change is not None:
                (first, second)[place][:] += sign * unknown.change
            else:
                unsolved = True
                rhs[place][self._nodes] += sign * unknown.force
        if unsolved:
            more = self._scheme.factor.solve_pair(*rhs)
            first += more[0]
            second += more[1]
        return first, second

    def blank(self) -> ForcedUnknown:
        """See `StepSystem`."""
        return ForcedUnknown(np.zeros((self._scheme.node_count, 3)))

    def pairs(
        self, forward: ForcedUnknown, backward: ForcedUnknown
    ) -> list[tuple[FloatArray, FloatArray]]:
        """See `StepSystem`."""
        return [(self._solution(backward), self._solution(forward))]

    def by_directions(
        self, forward: ForcedUnknown, backward: ForcedUnknown, target: FloatArray, slip: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`."""
        assert forward.multiplier is not None
        assert forward.at_nodes is not None
        assert backward.multiplier is not None
        assert backward.at_nodes is not None
        return directions_of_exact(
            forward.multiplier,
            forward.at_nodes,
            backward.multiplier,
            backward.at_nodes,
            target,
            slip,
        )

    def again(self, unknown: ForcedUnknown) -> ForcedUnknown:
        """See `StepSystem`."""
        return ForcedUnknown(unknown.free)

    def by_parameter(self, name: str, forward: ForcedUnknown, backward: ForcedUnknown) -> float:
        """See `StepSystem`."""
        pairs = self.pairs(forward, backward)
        change = -sum(float(np.sum(w * self.share(name, z))) for w, z in pairs)
        return change

    def share(self, name: str, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        out, m = np.empty_like(z), self._scheme.shares[name]
        matrix_product(m.indptr, m.indices, m.data, z, out)
        return out

    def product(self, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        out, m = np.empty_like(z), self._scheme.matrix
        matrix_product(m.indptr, m.indices, m.data, z, out)
        return out

    def held_rows(self, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        s, m = self._scheme, self._scheme.matrix
        out = np.empty((len(s.held), 3))
        product_rows(m.indptr, m.indices, m.data, s.held, z, out)
        return out

    def _solution(self, unknown: ForcedUnknown) -> FloatArray:
        if unknown.force is None:
            return unknown.free
        if unknown.change is not None:
            return unknown.free + unknown.change
        forces = np.zeros_like(unknown.free)
        forces[self._nodes] = unknown.force
        solution: FloatArray = unknown.free + self._scheme.factor.solve(forces)
        return solution
