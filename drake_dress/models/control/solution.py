"""What the solvers of linear-quadratic problems with norm bounds return."""

from __future__ import annotations

from dataclasses import dataclass

from drake_dress.models.arrays import FloatArray


@dataclass(frozen=True)
class Solution:
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
