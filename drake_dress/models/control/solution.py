"""Result of the solvers of linear-quadratic problems with norm bounds."""

from __future__ import annotations

from dataclasses import dataclass

from drake_dress.models.arrays import FloatArray


@dataclass(frozen=True)
class Solution:
    """Result of a solver.

    Attributes:
        v: (N,m) inputs; x: (N+1,n) states.
        state_multiplier: (N+1,K), input_multiplier: (N,L) of the norm bounds, not negative.
        cost: final cost.
        violation: largest bound violation.
        sweeps: number of backward and forward passes with an active set.
        interior_steps: number of interior point iterations.
        converged: whether the optimality conditions hold; False if a solver gave up.
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
