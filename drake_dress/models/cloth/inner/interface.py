"""What every inner iteration offers to a step and to its adjoint.

A step solves A z = rhs twice, for the motion and for the change of velocity, with A = M + h² K of
the scheme. Nodes in the grippers move as prescribed from the start. Nodes in contact are bound by
`hold`: sticking ones move by a target, slipping ones do so along their normal, and the forces that
this takes are what comes out. The adjoint of a step is made of the same solves, since every scheme
here is symmetric: the map from rhs to the free part of z is.

Schemes differ in A and in how far they iterate:

    one_step.py              A = P, exact: the paper's scheme with one iteration
    stationary.py            A = M + h² K₊, K iterations with P as the paper prints them
    conjugate_gradients.py   the same, by conjugate gradients with P as preconditioner
    direct.py                the limit of all of them, by a direct factor; for tests
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from drake_dress.models.cloth.elements import BoolArray, FloatArray, IntArray

# One of the solutions of a step, of a type that its scheme chooses; its `free` (n,3) is what it is
# without contact.
Unknown = Any


class StepSystem(Protocol):
    """The system of one step; made by `InnerIteration.at`, used for that step and its adjoint."""

    def start(
        self,
        motion: tuple[FloatArray, FloatArray],
        change: tuple[FloatArray, FloatArray],
    ) -> tuple[Unknown, Unknown]:
        """Returns both unknowns without contact.

        Args:
            motion: right-hand side (n,3) and values at the held nodes (k,3) of Δx.
            change: those of Δv.
        """

    def touch(self, nodes: IntArray) -> None:
        """Says which nodes (c,) later calls of `hold` may bind."""

    def hold(
        self,
        unknown: Unknown,
        mode: IntArray,
        normal: FloatArray,
        target: FloatArray,
        force: FloatArray | None = None,
        guess: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Binds nodes of an unknown, instead of what an earlier call bound.

        Args:
            unknown: whose solution is bound.
            mode: (c,) of each touched node: STICK takes all of `target`, SLIP its part along
                `normal`, FREE nothing.
            normal: (c,3) unit.
            target: (c,3) in the unknown's unit.
            force: (c,3) added to the right-hand side at the touched nodes.
            guess: (c,3) of the binding force, a start for iterations.

        Returns:
            The binding force λ (c,3), so that A z = rhs + force + λ, and z (c,3) at the nodes.
        """

    def finish(
        self, motion: Unknown, change: Unknown, less: Unknown | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Returns the solutions (n,3) of motion (with that of `less` taken off) and change."""

    def blank(self) -> Unknown:
        """Returns an unknown whose right-hand side and held values are zero."""

    def pairs(self, forward: Unknown, backward: Unknown) -> list[tuple[FloatArray, FloatArray]]:
        """Returns (w, z) so that z_forward changes by −Σ wᵀ δA z where A does, seen by `backward`.

        Args:
            forward: as a step solved it.
            backward: as its adjoint did, with the derivative of a loss by `forward` as right-hand
                side.
        """

    def by_normal(
        self,
        forward: Unknown,
        backward: Unknown,
        normal: FloatArray,
        target: FloatArray,
        slip: BoolArray,
    ) -> FloatArray:
        """Returns the derivative (c,3) of the motion by the normals of slipping nodes.

        Args:
            forward: as for `pairs`, with nodes bound by `hold`.
            backward: likewise.
            normal: (c,3) of the forward solve.
            target: (c,3) of the forward solve.
            slip: (c,) which nodes slip.
        """

    def again(self, unknown: Unknown) -> Unknown:
        """Returns another unknown with the right-hand side and held values of one."""

    def by_parameter(self, name: str, forward: Unknown, backward: Unknown) -> float:
        """Returns how a loss changes by a value of `Material` through the system alone.

        Args:
            name: `stretch_stiffness`, `bending_stiffness` or `surface_density`.
            forward: as for `pairs`.
            backward: likewise.
        """

    def share(self, name: str, z: FloatArray) -> FloatArray:
        """Returns ∂A/∂θ z (n,3), θ a value of `Material` by its name."""

    def product(self, z: FloatArray) -> FloatArray:
        """Returns A z (n,3)."""

    def held_rows(self, z: FloatArray) -> FloatArray:
        """Returns the rows of A z at the held nodes (k,3)."""


class InnerIteration(Protocol):
    """A scheme; made once a garment, material, step size and grasp."""

    depends_on_position: bool  # whether A does

    def derivative(self, x: FloatArray, w: FloatArray, z: FloatArray) -> FloatArray:
        """Returns ∂(wᵀ A(x) z)/∂x (n,3)."""

    def at(self, x: FloatArray) -> StepSystem:
        """Returns the system at positions `x` (n,3), m."""


def normal_of_exact(
    binding: FloatArray,
    z: FloatArray,
    back_binding: FloatArray,
    back_z: FloatArray,
    normal: FloatArray,
    target: FloatArray,
    slip: BoolArray,
) -> FloatArray:
    """Returns `StepSystem.by_normal` of a scheme that solves exactly; all (c,3), `slip` (c,).

    From P z = rhs + n ν, n·(z − target) = 0 and the same of the adjoint.
    """
    out = np.zeros_like(normal)
    n = normal[slip]
    pressing = np.einsum("ij,ij->i", binding[slip], n)
    along = np.einsum("ij,ij->i", back_binding[slip], n)
    out[slip] = pressing[:, None] * back_z[slip] + along[:, None] * (z[slip] - target[slip])
    return out
