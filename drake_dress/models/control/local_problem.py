"""The local optimal control problem: quadratic cost, integrators, norm bounds (Eq. loc_mpc).

With compensations x of sleeve centres and grippers, and v of gripper velocities,

    minimise    Σ_{j=0}^{N} ‖x_j − x̄_j‖²_{W_j} + Σ_{j=0}^{N−1} ‖v_j − v̄_j‖²_{R_j}
    subject to  x_{j+1} = x_j + B v_j
                ‖C_{jk} x_j + d_{jk}‖ ≤ φ_{jk},   ‖E_{jk} v_j + e_{jk}‖ ≤ ψ_{jk}.

It is a convex second-order cone programme.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.norm_bounds import NormBounds, violation
from drake_dress.models.control.reduced_problem import ReducedProblem


@dataclass(frozen=True)
class LocalProblem:
    """A problem with n states, m inputs, N steps.

    Attributes:
        start: (n,) x_0.
        input_matrix: (n,m) B.
        state_weight: (N+1,n) diagonal of W, zero or more; state_target: (N+1,n) x̄.
        input_weight: (N,m) diagonal of R, positive; input_target: (N,m) v̄.
        state_bounds: on x_0 … x_N; those on x_0 are ignored, because no input changes it.
        input_bounds: on v_0 … v_{N−1}.
        price: penalty on the sum of all excesses t, 1/m.
    """

    start: FloatArray
    input_matrix: FloatArray
    state_weight: FloatArray
    state_target: FloatArray
    input_weight: FloatArray
    input_target: FloatArray
    state_bounds: NormBounds
    input_bounds: NormBounds
    price: float = 1e3

    @property
    def horizon(self) -> int:
        """N."""
        return len(self.input_weight)

    def states(self, v: FloatArray) -> FloatArray:
        """Returns the states (N+1,n) that result from inputs `v` (N,m)."""
        moved = np.cumsum(v @ self.input_matrix.T, axis=0)
        x: FloatArray = self.start + np.concatenate([np.zeros((1, len(self.start))), moved])
        return x

    def cost(self, v: FloatArray) -> float:
        """Returns the cost of inputs `v` (N,m)."""
        x = self.states(v)
        return float(
            np.sum(self.state_weight * (x - self.state_target) ** 2)
            + np.sum(self.input_weight * (v - self.input_target) ** 2)
        )

    def spilled(self, v: FloatArray) -> float:
        """Returns the sum of the excesses t of all bounds at inputs `v` (N,m), m."""
        of_states = self.state_bounds.spilled(self.states(v))[1:].sum()
        return float(of_states + self.input_bounds.spilled(v).sum())

    def violation(self, v: FloatArray) -> float:
        """Returns the largest bound violation of inputs `v` (N,m); 0 if none."""
        return violation(self.state_bounds, self.states(v), self.input_bounds, v)

    def reduced(self) -> ReducedProblem:
        """Returns the problem in sums of inputs, u: x = x_0 + B u has m coordinates, not n."""
        b, w, r = self.input_matrix, 2.0 * self.state_weight, 2.0 * self.input_weight
        of_x, of_v = self.state_bounds, self.input_bounds
        return ReducedProblem(
            None,
            None,
            np.einsum("tn,na,nb->tab", w, b, b),
            (w * (self.start - self.state_target)) @ b,
            r,
            -r * self.input_target,
            NormBounds(of_x.matrix @ b, of_x.offset + of_x.matrix @ self.start, of_x.radius),
            of_v,
        )

    def about_start(self) -> ReducedProblem:
        """Returns the problem in all n states, as deviations from x_0."""
        (steps, _), n = self.input_weight.shape, len(self.start)
        w, r = np.zeros((steps + 1, n, n)), 2.0 * self.input_weight
        w[:, range(n), range(n)] = 2.0 * self.state_weight
        of_x = self.state_bounds
        return ReducedProblem(
            None,
            np.tile(self.input_matrix, (steps, 1, 1)),
            w,
            2.0 * self.state_weight * (self.start - self.state_target),
            r,
            -r * self.input_target,
            NormBounds(of_x.matrix, of_x.offset + of_x.matrix @ self.start, of_x.radius),
            self.input_bounds,
        )
