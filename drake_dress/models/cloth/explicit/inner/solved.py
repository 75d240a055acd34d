"""What the schemes on A = M + h² K₊ have in common: everything except the solver."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.contact.modes import SLIP, STICK
from drake_dress.models.cloth.explicit.inner.filtered import Filtered
from drake_dress.models.cloth.explicit.inner.interface import directions_of_exact
from drake_dress.models.cloth.explicit.inner.oblique import hold_obliquely


@dataclass
class Solved:
    """An unknown with its right-hand side (n,3), held values (k,3) and solution (n,3).

    `multiplier` (c,) holds the normal forces that bind nodes in contact.
    """

    rhs: FloatArray
    held: FloatArray
    free: FloatArray
    z: FloatArray
    multiplier: FloatArray | None = None


class FilteredScheme:
    """Data that a scheme keeps for all steps; see `InnerIteration`.

    Args:
        matrix: A(x).
        p: (n,n) P.
        held: (k,) nodes with prescribed motion.
        tolerance: relative tolerance of forces in the passes with friction.
    """

    depends_on_position = True

    def __init__(
        self, matrix: Filtered, p: sp.csc_matrix, held: IntArray, tolerance: float
    ) -> None:
        self.matrix = matrix
        self.held = held
        self.node_count = p.shape[0]
        self.system = matrix.system(p)
        self.tolerance = tolerance

    def derivative(self, x: FloatArray, w: FloatArray, z: FloatArray) -> FloatArray:
        """Returns ∂(wᵀ A(x) z)/∂x (n,3)."""
        return self.matrix.derivative(x, w, z)


class FilteredSystem(ABC):
    """(M + h² K₊) z = rhs of one step; see `StepSystem`.

    Args:
        scheme: scheme that made it.
        block: result of `Filtered.block`.
    """

    def __init__(self, scheme: FilteredScheme, block: FloatArray) -> None:
        self._base = scheme
        self._block = block
        self._nodes = np.zeros(0, dtype=np.int32)
        self.iterations = 0

    @abstractmethod
    def start(
        self,
        motion: tuple[FloatArray, FloatArray],
        change: tuple[FloatArray, FloatArray],
        guess: FloatArray | None = None,
    ) -> tuple[Any, Any]:
        """See `StepSystem`."""

    def touch(self, nodes: IntArray) -> None:
        """See `StepSystem`."""
        self._nodes = nodes

    def hold(
        self,
        unknown: Any,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
        push: FloatArray | None = None,
        guess: FloatArray | None = None,
        backward: bool = False,
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`; `guess` is not used."""

        def plain(target: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
            rhs = unknown.rhs.copy()
            rhs[self._nodes] += force
            product = self._bind(unknown, rhs, mode, normal, target)
            return self._binding(product, rhs, mode, normal), unknown.z[self._nodes]

        force, z, unknown.multiplier = hold_obliquely(
            plain, mode, normal, target, push, backward, self._base.tolerance
        )
        return force, z

    def finish(
        self, motion: Solved, change: Solved, less: Solved | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`."""
        return (motion.z if less is None else motion.z - less.z), change.z

    def blank(self) -> Any:
        """See `StepSystem`."""
        zero = np.zeros((self._base.node_count, 3))
        return self._unknown(zero, np.zeros((len(self._base.held), 3)), zero, zero)

    def again(self, unknown: Solved) -> Any:
        """See `StepSystem`."""
        return self._unknown(unknown.rhs, unknown.held, unknown.free, unknown.z)

    def pairs(self, forward: Any, backward: Any) -> list[tuple[FloatArray, FloatArray]]:
        """See `StepSystem`."""
        return [(backward.z, forward.z)]

    def by_directions(
        self, forward: Solved, backward: Solved, target: FloatArray, slip: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """See `StepSystem`."""
        assert forward.multiplier is not None
        assert backward.multiplier is not None
        z, back_z = forward.z[self._nodes], backward.z[self._nodes]
        return directions_of_exact(forward.multiplier, z, backward.multiplier, back_z, target, slip)

    def by_parameter(self, name: str, forward: Any, backward: Any) -> float:
        """See `StepSystem`."""
        pairs = self.pairs(forward, backward)
        return -sum(float(np.sum(w * self.share(name, z))) for w, z in pairs)

    def share(self, name: str, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        return self._base.matrix.share(name, self._block, z)

    def product(self, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        return self._base.system.product(z, self._block)

    def held_rows(self, z: FloatArray) -> FloatArray:
        """See `StepSystem`."""
        rows: FloatArray = self.product(z)[self._base.held]
        return rows

    def _binding(
        self, product: FloatArray, rhs: FloatArray, mode: IntArray, normal: FloatArray
    ) -> FloatArray:
        """Returns (c,3) the forces on bound nodes: A z − rhs, for slipping nodes along n."""
        binding: FloatArray = product[self._nodes] - rhs[self._nodes]
        slip = mode == SLIP
        n = normal[slip]
        binding[slip] = np.einsum("ij,ij->i", binding[slip], n)[:, None] * n
        binding[~(slip | (mode == STICK))] = 0.0
        return binding

    def _prescribed(
        self, held: FloatArray, mode: IntArray, normal: FloatArray, target: FloatArray
    ) -> FloatArray:
        """Returns (n,3) the prescribed values, zero elsewhere."""
        fixed = np.zeros((self._base.node_count, 3))
        fixed[self._base.held] = held
        stick, slip = mode == STICK, mode == SLIP
        n = normal[slip]
        fixed[self._nodes[stick]] = target[stick]
        fixed[self._nodes[slip]] = np.einsum("ij,ij->i", target[slip], n)[:, None] * n
        return fixed

    def _unknown(self, rhs: FloatArray, held: FloatArray, free: FloatArray, z: FloatArray) -> Any:
        return Solved(rhs, held, free, z)

    @abstractmethod
    def _bind(
        self,
        unknown: Any,
        rhs: FloatArray,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
    ) -> FloatArray:
        """Solves for `unknown.z` with nodes bound, without friction; returns A z (n,3)."""
