"""Interface of the inner iterations to a step and to its adjoint.

A step solves A z = rhs twice, for the motion and for the change of velocity, with A = M + h² K of
the scheme. Nodes in the grippers have prescribed values from the start. `hold` binds nodes in
contact: sticking ones move by a target, slipping ones do so only along their normal. It returns the
forces that this takes. The adjoint of a step consists of the same solves, because in every scheme
here the map from rhs to the free part of z is symmetric.

Schemes differ in A and in how far they iterate:

    one_step.py              A = P, exact: the paper's scheme with one iteration
    stationary.py            A = M + h² K₊, K iterations with P as the paper prints them
    conjugate_gradients.py   the same, by conjugate gradients with P as preconditioner
    direct.py                the limit of these iterations, by a direct factor; for tests
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray

# A solution of a step, of a type that its scheme chooses; its `free` (n,3) is the solution without
# contact.
Unknown = Any


class StepSystem(Protocol):
    """The system of one step; made by `InnerIteration.at`, used for that step and its adjoint.

    Attributes:
        iterations: number of linear-solver iterations so far, forward and backward.
    """

    iterations: int

    def start(
        self,
        motion: tuple[FloatArray, FloatArray],
        change: tuple[FloatArray, FloatArray],
        guess: FloatArray | None = None,
    ) -> tuple[Unknown, Unknown]:
        """Returns both unknowns without contact.

        Args:
            motion: right-hand side (n,3) and values at the held nodes (k,3) of Δx.
            change: those of Δv.
            guess: (n,3) initial guess of Δx, for iterative schemes.
        """

    def touch(self, nodes: IntArray) -> None:
        """Sets the nodes (c,) that later calls of `hold` may bind."""

    def hold(
        self,
        unknown: Unknown,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
        push: FloatArray | None = None,
        guess: FloatArray | None = None,
        backward: bool = False,
    ) -> tuple[FloatArray, FloatArray]:
        """Binds nodes of an unknown, in place of those that an earlier call bound.

        A slipping node is bound by the force ν (n + push), push = μ d its friction, so that
        n·z = n·target. The transposed problem has the force ν n, so that
        (n + push)·z = (n + push)·target.

        Args:
            unknown: unknown to bind.
            mode: (c,) of the touched nodes: STICK takes all of `target`, SLIP one row, FREE none.
            normal: (c,3) unit.
            target: (c,3) in the unknown's unit.
            push: (c,3) friction of slipping nodes per normal force, tangential to the surface.
            guess: (c,3) initial guess of ν n or of the sticking force.
            backward: solve the transposed problem.

        Returns:
            The binding force λ (c,3), so that A z = rhs + λ, and z (c,3) at the nodes.

        Raises:
            ValueError: the scheme has no transposed problem with friction.
        """

    def finish(
        self, motion: Unknown, change: Unknown, less: Unknown | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Returns the solutions (n,3) of motion (less that of `less`) and change."""

    def blank(self) -> Unknown:
        """Returns an unknown whose right-hand side and held values are zero."""

    def pairs(self, forward: Unknown, backward: Unknown) -> list[tuple[FloatArray, FloatArray]]:
        """Returns pairs (w, z): a change δA changes the loss of `backward` by −Σ wᵀ δA z.

        Args:
            forward: unknown that the step solved.
            backward: unknown that its adjoint solved, with the derivative of a loss by `forward` as
                right-hand side.
        """

    def by_directions(
        self, forward: Unknown, backward: Unknown, target: FloatArray, slip: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """Returns the derivatives (c,3) by row n and by binding n + push of slipping nodes.

        Args:
            forward: as for `pairs`, with nodes bound by `hold`.
            backward: likewise.
            target: (c,3) of the forward solve.
            slip: (c,) which nodes slip.
        """

    def again(self, unknown: Unknown) -> Unknown:
        """Returns a new unknown with the right-hand side and held values of `unknown`."""

    def by_parameter(self, name: str, forward: Unknown, backward: Unknown) -> float:
        """Returns the derivative of a loss by a value of `Material`, through the system alone.

        Args:
            name: `stretch_stiffness`, `bending_stiffness` or `surface_density`.
            forward: as for `pairs`.
            backward: likewise.
        """

    def share(self, name: str, z: FloatArray) -> FloatArray:
        """Returns ∂A/∂θ z (n,3), θ the value of `Material` with this name."""

    def product(self, z: FloatArray) -> FloatArray:
        """Returns A z (n,3)."""

    def held_rows(self, z: FloatArray) -> FloatArray:
        """Returns the rows of A z at the held nodes (k,3)."""


class InnerIteration(Protocol):
    """A scheme, made once per garment, material, step size and grasp."""

    depends_on_position: bool  # whether A does

    def derivative(self, x: FloatArray, w: FloatArray, z: FloatArray) -> FloatArray:
        """Returns ∂(wᵀ A(x) z)/∂x (n,3)."""

    def at(self, x: FloatArray) -> StepSystem:
        """Returns the system at positions `x` (n,3), m."""


def directions_of_exact(
    multiplier: FloatArray,
    z: FloatArray,
    back_multiplier: FloatArray,
    back_z: FloatArray,
    target: FloatArray,
    slip: BoolArray,
) -> tuple[FloatArray, FloatArray]:
    """Returns `StepSystem.by_directions` of a scheme that solves exactly.

    Follows from A z = rhs + ν b, a·(z − target) = 0 and the transposed pair.

    Args:
        multiplier: (c,) ν.
        z: (c,3) at the nodes.
        back_multiplier: (c,) ν of the adjoint.
        back_z: (c,3) z of the adjoint.
        target: (c,3) of the forward solve.
        slip: (c,) which nodes slip.
    """
    by_row = np.where(slip[:, None], back_multiplier[:, None] * (z - target), 0.0)
    by_binding = np.where(slip[:, None], multiplier[:, None] * back_z, 0.0)
    return by_row, by_binding
