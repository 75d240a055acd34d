"""A = M + h² K₊, by K iterations with P (Eq. iterative-solver).

The iteration z ← z + P⁻¹ (rhs − A z) starts from zero, with prescribed nodes at their values. As
0 ≤ A ≤ P, iterates are bounded by the solution. K iterations are a symmetric polynomial in P⁻¹A, so
the adjoint is the same K iterations. Each iteration enforces contact exactly, as `OneStep` does.
There is no derivative through slipping contact.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.explicit.inner.filtered import Filtered
from drake_dress.models.cloth.explicit.inner.one_step import OneStep, OneStepSystem
from drake_dress.models.cloth.explicit.inner.solved import FilteredScheme, FilteredSystem, Solved


@dataclass
class Iterates(Solved):
    """An unknown with its corrections `steps` and the `iterates` they add to, K of each (n,3)."""

    steps: list[FloatArray] = field(default_factory=list)
    iterates: list[FloatArray] = field(default_factory=list)


class Stationary(FilteredScheme):
    """The scheme with K iterations; see `InnerIteration`.

    Args:
        matrix: A(x).
        p: (n,n) P.
        one_step: the scheme that solves with P.
        iterations: K.
    """

    def __init__(
        self, matrix: Filtered, p: sp.csc_matrix, one_step: OneStep, iterations: int
    ) -> None:
        super().__init__(matrix, p, one_step.held, one_step.tolerance)
        self.one_step = one_step
        self.iterations = iterations

    def at(self, x: FloatArray) -> StationarySystem:
        """Returns the system at positions `x` (n,3), m."""
        return StationarySystem(self, self.matrix.block(x))


class StationarySystem(FilteredSystem):
    """K iterations on (M + h² K₊) z = rhs; see `StepSystem`."""

    def __init__(self, scheme: Stationary, block: FloatArray) -> None:
        super().__init__(scheme, block)
        self._scheme = scheme
        self._held = scheme.held
        self._p: OneStepSystem = scheme.one_step.at(np.zeros((0, 3)))

    def start(
        self,
        motion: tuple[FloatArray, FloatArray],
        change: tuple[FloatArray, FloatArray],
        guess: FloatArray | None = None,
    ) -> tuple[Iterates, Iterates]:
        """See `StepSystem`; `guess` is not used."""
        return self._free(*motion), self._free(*change)

    def touch(self, nodes: IntArray) -> None:
        """See `StepSystem`."""
        super().touch(nodes)
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
        """See `StepSystem`; `guess` is not used."""
        if backward and push is not None and push.any():
            raise ValueError(
                "the stationary scheme has no derivative through slipping contact: "
                "take one_step or conjugate_gradients"
            )
        return super().hold(unknown, mode, normal, target, push, guess, backward)

    def pairs(self, forward: Iterates, backward: Iterates) -> list[tuple[FloatArray, FloatArray]]:
        """See `StepSystem`: every iteration uses A once.

        The first iterate contains the prescribed values. The adjoint starts from zero except at
        prescribed values; these multiply A times the last iterate.
        """
        found = list(zip(reversed(backward.steps), forward.iterates, strict=True))
        if backward.iterates and np.any(backward.iterates[0]):
            found.append((backward.iterates[0], forward.z))
        return found

    def by_parameter(self, name: str, forward: Iterates, backward: Iterates) -> float:
        """See `StepSystem`."""
        change = super().by_parameter(name, forward, backward)
        change -= sum(
            float(np.sum(w * self._p.share(name, step)))
            for w, step in zip(reversed(backward.steps), forward.steps, strict=True)
        )
        return change

    def _unknown(
        self, rhs: FloatArray, held: FloatArray, free: FloatArray, z: FloatArray
    ) -> Iterates:
        return Iterates(rhs, held, free, z)

    def _free(self, rhs: FloatArray, held: FloatArray) -> Iterates:
        start = np.zeros_like(rhs)
        start[self._held] = held
        unknown = Iterates(rhs, held, rhs, rhs)
        self._iterate(unknown, rhs, start, None)
        unknown.free = unknown.z
        return unknown

    def _bind(
        self,
        unknown: Iterates,
        rhs: FloatArray,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
    ) -> FloatArray:
        start = self._prescribed(unknown.held, mode, normal, target)
        self._iterate(unknown, rhs, start, (mode, normal))
        return self.product(unknown.z)

    def _iterate(
        self,
        unknown: Iterates,
        rhs: FloatArray,
        z: FloatArray,
        contact: tuple[IntArray, FloatArray] | None,
    ) -> None:
        """Runs K iterations from `z`; `contact` is (mode, normal) of bound nodes, if any."""
        still = np.zeros((len(self._held), 3))
        blank = np.zeros_like(rhs)
        unknown.steps, unknown.iterates = [], []
        self.iterations += self._scheme.iterations
        for _ in range(self._scheme.iterations):
            unknown.iterates.append(z)
            correction, other = self._p.start((rhs - self.product(z), still), (blank, still))
            if contact is not None:
                self._p.hold(correction, *contact, np.zeros((len(self._nodes), 3)))
            step = self._p.finish(correction, other)[0]
            unknown.steps.append(step)
            z = z + step
        unknown.z = z
