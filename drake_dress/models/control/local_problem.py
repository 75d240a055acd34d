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


@dataclass(frozen=True)
class NormBounds:
    """Bounds on the norms of affine functions, a row of them for each step.

    Attributes:
        matrix: (T,K,3,n). offset: (T,K,3).
        radius: (T,K), positive; infinite where there is no bound.
    """

    matrix: FloatArray
    offset: FloatArray
    radius: FloatArray

    def norms(self, z: FloatArray) -> FloatArray:
        """Returns (T,K) the norms at `z` (T,n)."""
        y = np.einsum("tkab,tb->tka", self.matrix, z) + self.offset
        length: FloatArray = np.linalg.norm(y, axis=2)
        return length

    def excess(self, z: FloatArray) -> FloatArray:
        """Returns (T,K) by how much the norms at `z` (T,n) exceed their bounds; negative within."""
        return self.norms(z) - self.radius

    def spilled(self, z: FloatArray) -> FloatArray:
        """Returns (T,K) the least t with ‖·‖² ≤ φ² + 2 φ t at `z` (T,n); 0 where there is none."""
        bounded = np.isfinite(self.radius)
        phi = np.where(bounded, self.radius, 1.0)
        t = np.maximum(0.0, 0.5 * (self.norms(z) ** 2 / phi - phi))
        return np.where(bounded, t, 0.0)


@dataclass(frozen=True)
class LocalProblem:
    """One problem; n states, m inputs, N steps.

    Attributes:
        start: (n,) x_0.
        input_matrix: (n,m) B.
        state_weight: (N+1,n) diagonal of W, zero or more; state_target: (N+1,n) x̄.
        input_weight: (N,m) diagonal of R, positive; input_target: (N,m) v̄.
        state_bounds: on x_0 … x_N; those on x_0 are not up to anyone and are passed over.
        input_bounds: on v_0 … v_{N−1}.
        price: of the sum of all t, 1/m.
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
        """Returns (N+1,n) the states that inputs `v` (N,m) lead to."""
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
        """Returns the sum of t of all bounds at inputs `v` (N,m), m."""
        of_states = self.state_bounds.spilled(self.states(v))[1:].sum()
        return float(of_states + self.input_bounds.spilled(v).sum())

    def violation(self, v: FloatArray) -> float:
        """Returns by how much inputs `v` (N,m) exceed the worst bound; 0 if none."""
        over = self.state_bounds.excess(self.states(v))[1:].max(initial=0.0)
        return float(max(0.0, over, self.input_bounds.excess(v).max(initial=0.0)))


@dataclass(frozen=True)
class LocalSolution:
    """What a solver returns.

    Attributes:
        v: (N,m) inputs; x: (N+1,n) states.
        state_multiplier: (N+1,K), input_multiplier: (N,L) of the norm bounds, zero or more.
        cost: reached.
        violation: of the worst bound.
        sweeps: backward and forward passes with an active set.
        interior_steps: with barriers instead.
        converged: the conditions of optimality hold; never where a solver gave up.
    """

    v: FloatArray
    x: FloatArray
    state_multiplier: FloatArray
    input_multiplier: FloatArray
    cost: float
    violation: float
    sweeps: int
    interior_steps: int
    converged: bool
