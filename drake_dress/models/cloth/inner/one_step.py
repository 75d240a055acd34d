"""A = P: the paper's scheme with one iteration, exact, contact included.

P = M + h² Σ w AᵀA never changes, so its factor with the grippers' nodes left out is made once.
Contact adds unknown forces λ at its nodes. Their motion is E z_free + S λ, S = E P⁻¹ Eᵀ: P_ic⁻¹ of
the paper, of which nothing is formed. Conjugate gradients find λ, with S applied by the few columns
of the factor that the contact nodes reach and the sparse block P_cc as preconditioner.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
import scipy.sparse as sp

from drake_dress.models.cloth.elements import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.factor.masked import Factor, SymbolicFactor, restricted_solve
from drake_dress.models.cloth.filtered_cg import SLIP, STICK, dot, matrix_product
from drake_dress.models.cloth.inner.interface import directions_of_exact
from drake_dress.models.cloth.matrices import Csr

# Contacts from which a factor of its own costs less than iterations, measured at 6,000 nodes.
MANY = 500
_NO_NODES = np.zeros(0, dtype=np.int32)
_NO_PUSH = np.zeros((0, 3))
# Vectors that GMRES keeps before it starts anew.
_RESTART = 60


@dataclass
class ForcedUnknown:
    """Solution without contact (n,3).

    Where nodes are bound: the forces (c,3) that change it, their multipliers ν (c,) where nodes
    slip, and the solution at the nodes (c,3).
    """

    free: FloatArray
    force: FloatArray | None = None
    multiplier: FloatArray | None = None
    at_nodes: FloatArray | None = None


class OneStep:
    """The scheme with one iteration; see `InnerIteration`.

    Args:
        p: (n,n) P, symmetric positive definite.
        shares: its derivatives by values of `Material`, by their names.
        held: (k,) nodes with prescribed motion.
        tolerance: of the motion of nodes in contact, relative to how far they are moved.
        max_iterations: of conjugate gradients and of GMRES.
        many: contacts from which sticking nodes are left out of a factor of their own.
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
        self.tolerance = tolerance
        self.max_iterations = max_iterations
        self.node_count = n

    def derivative(self, x: FloatArray, w: FloatArray, z: FloatArray) -> FloatArray:
        """Returns zero (n,3): P is the same for all positions."""
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
        self, motion: tuple[FloatArray, FloatArray], change: tuple[FloatArray, FloatArray]
    ) -> tuple[ForcedUnknown, ForcedUnknown]:
        """See `StepSystem`."""
        s, m = self._scheme, self._scheme.matrix
        rhs = []
        for right, held in (motion, change):
            r = right.copy()
            _subtract_held(m.indptr, m.indices, m.data, s.held, held, r)
            rhs.append(r)
        first, second = s.factor.solve_pair(*rhs)
        first[s.held] = motion[1]
        second[s.held] = change[1]
        return ForcedUnknown(first), ForcedUnknown(second)

    def touch(self, nodes: IntArray) -> None:
        """See `StepSystem`."""
        s, m = self._scheme, self._scheme.matrix
        self._nodes = nodes
        self._part = s.factor.part(nodes)
        self._block = _block(m.indptr, m.indices, m.data, nodes)

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
        bound = np.zeros_like(free) if guess is None else guess.copy()
        moved = np.zeros_like(free)
        oblique = push is not None and bool(push.any())
        side = _NO_PUSH if push is None else push
        if guess is not None:
            project(bound, mode, normal)
            pushed = with_friction(bound, mode, normal, side) if oblique and not backward else bound
            restricted_solve(self._part, pushed, moved)
        solve = _bind_oblique if oblique else _bind
        iterations, _ = solve(
            self._part,
            self._block,
            mode,
            normal,
            side,
            backward,
            target - free,
            bound,
            moved,
            s.tolerance,
            s.max_iterations,
        )
        self.iterations += iterations
        unknown.multiplier = np.einsum("ij,ij->i", bound, normal)
        unknown.force = (
            with_friction(bound, mode, normal, side) if oblique and not backward else bound
        )
        unknown.at_nodes = free + moved
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
        """Does the same by a factor that leaves the sticking nodes out.

        What is sought is the correction y of the free solution: P y is zero but at bound nodes.
        """
        s, m, nodes = self._scheme, self._scheme.matrix, self._nodes
        stick, slip = np.flatnonzero(mode == STICK), np.flatnonzero(mode == SLIP)
        factor = self._factor_without(nodes[stick])
        free = unknown.free[nodes]
        lack = target - free
        rhs = np.zeros_like(unknown.free)
        _subtract_held(m.indptr, m.indices, m.data, nodes[stick], lack[stick], rhs)
        correction = factor.solve(rhs)
        correction[nodes[stick]] = lack[stick]
        force = np.zeros_like(lack)
        multiplier = np.zeros(len(nodes))
        if len(slip):
            sliding = nodes[slip]
            side = _NO_PUSH if push is None else push[slip]
            oblique = push is not None and bool(side.any())
            bound, moved = np.zeros((len(slip), 3)), np.zeros((len(slip), 3))
            solve = _bind_oblique if oblique else _bind
            iterations, _ = solve(
                factor.part(sliding),
                _block(m.indptr, m.indices, m.data, sliding),
                mode[slip],
                normal[slip],
                side,
                backward,
                lack[slip] - correction[sliding],
                bound,
                moved,
                s.tolerance,
                s.max_iterations,
            )
            self.iterations += iterations
            multiplier[slip] = np.einsum("ij,ij->i", bound, normal[slip])
            if oblique and not backward:
                bound = with_friction(bound, mode[slip], normal[slip], side)
            force[slip] = bound
            rhs = np.zeros_like(rhs)
            rhs[sliding] = bound
            correction += factor.solve(rhs)
        rows = np.empty((len(stick), 3))
        _rows(m.indptr, m.indices, m.data, nodes[stick], correction, rows)
        force[stick] = rows
        multiplier[stick] = np.einsum("ij,ij->i", rows, normal[stick])
        unknown.force, unknown.multiplier = force, multiplier
        unknown.at_nodes = free + correction[nodes]
        return force, unknown.at_nodes

    def _factor_without(self, nodes: IntArray) -> Factor:
        """Returns the factor of P without held and given nodes; the last ones are kept."""
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
        first = np.zeros_like(motion.free)
        second = np.zeros_like(motion.free)
        if motion.force is not None:
            first[self._nodes] += motion.force
        if less is not None and less.force is not None:
            first[self._nodes] -= less.force
        if change.force is not None:
            second[self._nodes] += change.force
        first, second = self._scheme.factor.solve_pair(first, second)
        first += motion.free
        second += change.free
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
        assert forward.multiplier is not None and forward.at_nodes is not None
        assert backward.multiplier is not None and backward.at_nodes is not None
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
        _rows(m.indptr, m.indices, m.data, s.held, z, out)
        return out

    def _solution(self, unknown: ForcedUnknown) -> FloatArray:
        if unknown.force is None:
            return unknown.free
        forces = np.zeros_like(unknown.free)
        forces[self._nodes] = unknown.force
        solution: FloatArray = unknown.free + self._scheme.factor.solve(forces)
        return solution


@nb.njit(cache=True, nogil=True)
def _bind(  # type: ignore[no-untyped-def]
    part, block, mode, normal, push, backward, lack, binding, moved, tolerance, most
):
    """Conjugate gradients on Π S Π λ = Π lack; improves `binding` and its motion S λ in place."""
    k = mode.shape[0]
    residual = lack.copy()
    project(residual, mode, normal)
    conditioned = np.empty((k, 3))
    _precondition(block, mode, normal, residual, conditioned)
    floor = max(dot(residual, conditioned), 1e-300)
    for i in range(k):
        for c in range(3):
            residual[i, c] = lack[i, c] - moved[i, c]
    project(residual, mode, normal)
    _precondition(block, mode, normal, residual, conditioned)
    rho = dot(residual, conditioned)
    direction = conditioned.copy()
    step = np.empty((k, 3))
    iterations = 0
    while iterations < most and rho > tolerance * tolerance * floor:
        restricted_solve(part, direction, step)
        curvature = dot(direction, step)
        if curvature <= 0.0:
            break
        alpha = rho / curvature
        for i in range(k):
            for c in range(3):
                binding[i, c] += alpha * direction[i, c]
                moved[i, c] += alpha * step[i, c]
        project(step, mode, normal)
        for i in range(k):
            for c in range(3):
                residual[i, c] -= alpha * step[i, c]
        _precondition(block, mode, normal, residual, conditioned)
        new = dot(residual, conditioned)
        beta = new / rho
        rho = new
        for i in range(k):
            for c in range(3):
                direction[i, c] = conditioned[i, c] + beta * direction[i, c]
        iterations += 1
    return iterations, np.sqrt(rho / floor)


@nb.njit(cache=True, nogil=True)
def _bind_oblique(  # type: ignore[no-untyped-def]
    part, block, mode, normal, push, backward, lack, binding, moved, tolerance, most
):
    """The same with friction, which makes the system unsymmetric: GMRES (Saad and Schultz 1986).

    Preconditioned from the right, in the inner product of the preconditioner, so that the residual
    is measured as in `_bind`. Vectors are as short as there are nodes in contact: all are kept.
    """
    k = mode.shape[0]
    residual = lack.copy()
    _rows_of(residual, mode, normal, push, backward)
    conditioned = np.empty((k, 3))
    _precondition(block, mode, normal, residual, conditioned)
    goal = tolerance * np.sqrt(max(dot(residual, conditioned), 1e-300))
    basis = np.empty((_RESTART + 1, k, 3))
    along = np.empty((_RESTART + 1, k, 3))
    motion = np.empty((_RESTART, k, 3))
    hessenberg = np.zeros((_RESTART + 1, _RESTART))
    cosine, sine = np.empty(_RESTART), np.empty(_RESTART)
    right = np.empty(_RESTART + 1)
    iterations = 0
    size = 0.0
    while True:
        for i in range(k):
            for c in range(3):
                residual[i, c] = lack[i, c] - moved[i, c]
        _rows_of(residual, mode, normal, push, backward)
        _precondition(block, mode, normal, residual, conditioned)
        size = np.sqrt(max(dot(residual, conditioned), 0.0))
        if size <= goal or iterations >= most:
            break
        for i in range(k):
            for c in range(3):
                basis[0, i, c] = residual[i, c] / size
                along[0, i, c] = conditioned[i, c] / size
        right[0] = size
        count = 0
        while count < _RESTART and iterations < most and abs(right[count]) > goal:
            j = count
            if backward:
                restricted_solve(part, along[j], motion[j])
            else:
                forces = with_friction(along[j], mode, normal, push)
                restricted_solve(part, forces, motion[j])
            residual[:] = motion[j]
            _rows_of(residual, mode, normal, push, backward)
            for i in range(j + 1):
                h = dot(residual, along[i])
                hessenberg[i, j] = h
                for q in range(k):
                    for c in range(3):
                        residual[q, c] -= h * basis[i, q, c]
            _precondition(block, mode, normal, residual, conditioned)
            h = np.sqrt(max(dot(residual, conditioned), 0.0))
            for i in range(j):
                u, w = hessenberg[i, j], hessenberg[i + 1, j]
                hessenberg[i, j] = cosine[i] * u + sine[i] * w
                hessenberg[i + 1, j] = cosine[i] * w - sine[i] * u
            u = hessenberg[j, j]
            length = np.sqrt(u * u + h * h)
            iterations += 1
            if length == 0.0:
                break
            cosine[j], sine[j] = u / length, h / length
            hessenberg[j, j] = length
            right[j + 1] = -sine[j] * right[j]
            right[j] = cosine[j] * right[j]
            count += 1
            if h <= 1e-14 * length:
                break
            for q in range(k):
                for c in range(3):
                    basis[j + 1, q, c] = residual[q, c] / h
                    along[j + 1, q, c] = conditioned[q, c] / h
        if count == 0:
            break
        for i in range(count - 1, -1, -1):
            for j in range(i + 1, count):
                right[i] -= hessenberg[i, j] * right[j]
            right[i] /= hessenberg[i, i]
        for j in range(count):
            for i in range(k):
                for c in range(3):
                    binding[i, c] += right[j] * along[j, i, c]
                    moved[i, c] += right[j] * motion[j, i, c]
    return iterations, tolerance * size / goal


@nb.njit(cache=True, nogil=True)
def with_friction(force, mode, normal, push):  # type: ignore[no-untyped-def]
    """Returns ν (n + push) for slipping nodes whose force (c,3) is ν n, the others as they are."""
    out = force.copy()
    for i in range(mode.shape[0]):
        if mode[i] == SLIP:
            nu = (
                force[i, 0] * normal[i, 0] + force[i, 1] * normal[i, 1] + force[i, 2] * normal[i, 2]
            )
            for c in range(3):
                out[i, c] += nu * push[i, c]
    return out


@nb.njit(cache=True, nogil=True)
def _rows_of(z, mode, normal, push, backward):  # type: ignore[no-untyped-def]
    """Projects motions (c,3), in place; backward the row of slipping nodes is n + push."""
    if backward:
        for i in range(mode.shape[0]):
            if mode[i] == SLIP:
                extra = z[i, 0] * push[i, 0] + z[i, 1] * push[i, 1] + z[i, 2] * push[i, 2]
                for c in range(3):
                    z[i, c] += extra * normal[i, c]
    project(z, mode, normal)


@nb.njit(cache=True, nogil=True)
def project(z, mode, normal):  # type: ignore[no-untyped-def]
    """Keeps of `z` (c,3), in place, what the modes bind: all, the normal part, nothing."""
    for i in range(mode.shape[0]):
        if mode[i] == SLIP:
            d = z[i, 0] * normal[i, 0] + z[i, 1] * normal[i, 1] + z[i, 2] * normal[i, 2]
            z[i, 0] = d * normal[i, 0]
            z[i, 1] = d * normal[i, 1]
            z[i, 2] = d * normal[i, 2]
        elif mode[i] != STICK:
            z[i, 0] = 0.0
            z[i, 1] = 0.0
            z[i, 2] = 0.0


@nb.njit(cache=True, nogil=True)
def _precondition(block, mode, normal, residual, out):  # type: ignore[no-untyped-def]
    indptr, indices, data = block
    matrix_product(indptr, indices, data, residual, out)
    project(out, mode, normal)


@nb.njit(cache=True, nogil=True)
def _subtract_held(indptr, indices, data, held, motion, rhs):  # type: ignore[no-untyped-def]
    """Takes P_fh `motion` (k,3) off `rhs` (n,3), in place; rows of held nodes have no meaning."""
    for k in range(held.shape[0]):
        i = held[k]
        for q in range(indptr[i], indptr[i + 1]):
            j = indices[q]
            for c in range(3):
                rhs[j, c] -= data[q] * motion[k, c]


@nb.njit(cache=True, nogil=True)
def _rows(indptr, indices, data, nodes, z, out):  # type: ignore[no-untyped-def]
    for k in range(nodes.shape[0]):
        i = nodes[k]
        for c in range(3):
            out[k, c] = 0.0
        for q in range(indptr[i], indptr[i + 1]):
            for c in range(3):
                out[k, c] += data[q] * z[indices[q], c]


@nb.njit(cache=True, nogil=True)
def _block(indptr, indices, data, nodes):  # type: ignore[no-untyped-def]
    """Returns the block of a CSR matrix between `nodes` (c,), as CSR."""
    k = nodes.shape[0]
    local = np.full(indptr.shape[0] - 1, -1, dtype=np.int32)
    for a in range(k):
        local[nodes[a]] = a
    start = np.zeros(k + 1, dtype=np.int32)
    for a in range(k):
        i = nodes[a]
        for q in range(indptr[i], indptr[i + 1]):
            if local[indices[q]] >= 0:
                start[a + 1] += 1
    for a in range(k):
        start[a + 1] += start[a]
    column = np.empty(start[k], dtype=np.int32)
    value = np.empty(start[k])
    at = 0
    for a in range(k):
        i = nodes[a]
        for q in range(indptr[i], indptr[i + 1]):
            b = local[indices[q]]
            if b >= 0:
                column[at] = b
                value[at] = data[q]
                at += 1
    return start, column, value
