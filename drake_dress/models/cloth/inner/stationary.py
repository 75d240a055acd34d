"""A = M + h² K₊, by K iterations with P (Eq. iterative-solver).

z ← z + P⁻¹ (rhs − A z) starts from zero with prescribed nodes in place. As 0 ≤ A ≤ P, iterates are
bounded by the solution, and K iterations are a symmetric polynomial in P⁻¹A: the adjoint is the
same K iterations. Contact is held in every one of them, exactly, as `OneStep` does; through
slipping contact there is no derivative.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from drake_dress.models.cloth.elements import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.filtered_cg import SLIP, STICK
from drake_dress.models.cloth.inner.filtered import Filtered
from drake_dress.models.cloth.inner.oblique import hold_obliquely
from drake_dress.models.cloth.inner.one_step import OneStep, OneStepSystem


@dataclass
class Iterates:
    """An unknown with its right-hand side (n,3), held values (k,3) and solution (n,3).

    `steps` are the corrections and `iterates` what they were added to, K of each. `multiplier` (c,)
    is what binds nodes in contact along their normals.
    """

    rhs: FloatArray
    held: FloatArray
    free: FloatArray
    z: FloatArray
    steps: list[FloatArray] = field(default_factory=list)
    iterates: list[FloatArray] = field(default_factory=list)
    multiplier: FloatArray | None = None


class Stationary:
    """The scheme with K iterations; see `InnerIteration`.

    Args:
        matrix: A(x).
        p: (n,n) P.
        one_step: the scheme that solves with P.
        iterations: K.
    """

    depends_on_position = True

    def __init__(
        self, matrix: Filtered, p: sp.csc_matrix, one_step: OneStep, iterations: int
    ) -> None:
        self.matrix = matrix
        self.one_step = one_step
        self.iterations = iterations
        self.system = matrix.system(p)

    def derivative(self, x: FloatArray, w: FloatArray, z: FloatArray) -> FloatArray:
        """Returns ∂(wᵀ A(x) z)/∂x (n,3)."""
        return self.matrix.derivative(x, w, z)

    def at(self, x: FloatArray) -> StationarySystem:
        """Returns the system at positions `x` (n,3), m."""
        return StationarySystem(self, self.matrix.block(x))


class StationarySystem:
    """K iterations on (M + h² K₊) z = rhs; see `StepSystem`."""

    def __init__(self, scheme: Stationary, block: FloatArray) -> None:
        self._scheme = scheme
        self._block = block
        self._held = scheme.one_step.held
        self._p: OneStepSystem = scheme.one_step.at(np.zeros((0, 3)))
        self._nodes = np.zeros(0, dtype=np.int32)

    def start(
        self, motion: tuple[FloatArray, FloatArray], change: tuple[FloatArray, FloatArray]
    ) -> tuple[Iterates, Iterates]:
        """See `StepSystem`."""
        return self._free(*motion), self._free(*change)

    def touch(self, nodes: IntArray) -> None:
        """See `StepSystem`."""
        self._nodes = nodes
        self._p.touch(nodes)

    def hold(
        self,
        unknown: Iterates,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
        push: FloatArray | None = None,
        guess: FloatArray | None = None,
        backward: bool = False,
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`; there is nothing to guess."""
        if backward and push is not None and push.any():
            raise ValueError(
                "the stationary scheme has no derivative through slipping contact: "
                "take one_step or conjugate_gradients"
            )

        def plain(target: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
            return self._hold(unknown, mode, normal, target, force)

        force, z, unknown.multiplier = hold_obliquely(
            plain, mode, normal, target, push, backward, self._scheme.one_step.tolerance
        )
        return force, z

    def finish(
        self, motion: Iterates, change: Iterates, less: Iterates | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`."""
        return (motion.z if less is None else motion.z - less.z), change.z

    def blank(self) -> Iterates:
        """See `StepSystem`."""
        zero = np.zeros((self._scheme.one_step.node_count, 3))
        return Iterates(zero, np.zeros((len(self._held), 3)), zero, zero)

    def by_directions(
        self, forward: Iterates, backward: Iterates, target: FloatArray, slip: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`."""
        raise ValueError(
            "the stationary scheme has no derivative through slipping contact: "
            "take one_step or conjugate_gradients"
        )

    def again(self, unknown: Iterates) -> Iterates:
        """See `StepSystem`."""
        return Iterates(unknown.rhs, unknown.held, unknown.free, unknown.z)

    def pairs(self, forward: Iterates, backward: Iterates) -> list[tuple[FloatArray, FloatArray]]:
        """See `StepSystem`: every iteration read A once.

        What prescribed nodes pull with stands in the first iterate; the adjoint's own start is
        zero where nothing is prescribed, and what it is elsewhere multiplies A on the last iterate.
        """
        found = list(zip(reversed(backward.steps), forward.iterates, strict=True))
        if backward.iterates and np.any(backward.iterates[0]):
            found.append((backward.iterates[0], forward.z))
        return found

    def by_parameter(self, name: str, forward: Iterates, backward: Iterates) -> float:
        """See `StepSystem`."""
        pairs = self.pairs(forward, backward)
        change = -sum(float(np.sum(w * self.share(name, z))) for w, z in pairs)
        change -= sum(
            float(np.sum(w * self._p.share(name, step)))
            for w, step in zip(reversed(backward.steps), forward.steps, strict=True)
        )
        return change

    def share(self, name: str, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        return self._scheme.matrix.share(name, self._block, z)

    def product(self, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        return self._scheme.system.product(z, self._block)

    def held_rows(self, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        rows: FloatArray = self.product(z)[self._held]
        return rows

    def _hold(
        self,
        unknown: Iterates,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
        force: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Binds without friction; returns what binds and z at the nodes."""
        nodes = self._nodes
        rhs = unknown.rhs.copy()
        rhs[nodes] += force
        slip, bound = mode == SLIP, (mode == SLIP) | (mode == STICK)
        start = np.zeros_like(rhs)
        start[self._held] = unknown.held
        start[nodes[bound]] = target[bound]
        n = normal[slip]
        start[nodes[slip]] = np.einsum("ij,ij->i", target[slip], n)[:, None] * n
        self._iterate(unknown, rhs, start, (mode, normal))
        binding: FloatArray = (self.product(unknown.z) - rhs)[nodes]
        binding[slip] = np.einsum("ij,ij->i", binding[slip], n)[:, None] * n
        binding[~bound] = 0.0
        return binding, unknown.z[nodes]

    def _free(self, rhs: FloatArray, held: FloatArray) -> Iterates:
        start = np.zeros_like(rhs)
        start[self._held] = held
        unknown = Iterates(rhs, held, rhs, rhs)
        self._iterate(unknown, rhs, start, None)
        unknown.free = unknown.z
        return unknown

    def _iterate(
        self,
        unknown: Iterates,
        rhs: FloatArray,
        z: FloatArray,
        contact: tuple[IntArray, FloatArray] | None,
    ) -> None:
        """Runs K iterations from `z`; (mode, normal) of the touched nodes where they are bound."""
        still = np.zeros((len(self._held), 3))
        blank = np.zeros_like(rhs)
        unknown.steps, unknown.iterates = [], []
        for _ in range(self._scheme.iterations):
            unknown.iterates.append(z)
            correction, other = self._p.start((rhs - self.product(z), still), (blank, still))
            if contact is not None:
                self._p.hold(correction, *contact, np.zeros((len(self._nodes), 3)))
            step = self._p.finish(correction, other)[0]
            unknown.steps.append(step)
            z = z + step
        unknown.z = z
