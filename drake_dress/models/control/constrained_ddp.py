"""Constrained differential dynamic programming (Alg. cddp) for linear-quadratic problems.

Backward pass: the cost-to-go is quadratic in the state. Active bounds are linearized in the state
and input of a step. The part that no input can change, the null space, is a constraint on the state
and is passed to the preceding step (Eq. future-constraint). Forward pass: the feedback law gives
the new trajectory and the multipliers of the bounds. Multipliers travel the other way: a constraint
that was passed to an earlier step passes its multiplier back. Bounds without a positive multiplier
leave the active set, and bounds that the new trajectory exceeds enter it (Eq. sigma_j). A line
search shortens the step until the sum of cost and priced excess falls.

Three things are added to the paper's method. Each row carries the residual of its bound, because a
tangent plane alone drifts off a ball. The curvature of a ball, weighted by its multiplier, is part
of the cost; with it the passes converge quadratically and end on the bounds to rounding error.
Linearly dependent rows, such as seven bounds on six inputs, are dropped.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control import ddp_passes
from drake_dress.models.control.ddp_passes import MeasuredBounds, QuadraticCost
from drake_dress.models.control.interior_point import interior_point
from drake_dress.models.control.norm_bounds import NormBounds
from drake_dress.models.control.reduced_problem import ReducedProblem
from drake_dress.models.control.solution import Solution


@dataclass(frozen=True)
class Settings:
    """Iteration limits and tolerance.

    Attributes:
        warm_sweeps: limit of sweeps, each a backward and a forward pass, from the multipliers of an
            earlier solution, before the interior point method is used.
        max_sweeps: limit of sweeps after the interior point method.
        max_halvings: limit of halvings of a step that does not reduce cost and excess.
        max_interior_steps: iteration limit of the interior point method; a third of it applies from
            an initial guess.
        tolerance: tolerance of the interior point method, see `interior_point`.
    """

    warm_sweeps: int = 4
    max_sweeps: int = 20
    max_halvings: int = 12
    max_interior_steps: int = 120
    tolerance: float = 1e-8


class Problem(Protocol):
    """Interface of a solvable problem, such as `LocalProblem` or `LinearQuadraticProblem`."""

    @property
    def state_bounds(self) -> NormBounds:
        """Bounds on x_0 … x_N."""

    @property
    def price(self) -> float:
        """Penalty on the sum of all excesses."""

    def states(self, v: FloatArray) -> FloatArray:
        """Returns the states (N+1,n) that result from inputs `v` (N,m)."""

    def cost(self, v: FloatArray) -> float:
        """Returns the cost of inputs `v` (N,m)."""

    def violation(self, v: FloatArray) -> float:
        """Returns the largest bound violation of inputs `v` (N,m); 0 if none."""

    def reduced(self) -> ReducedProblem:
        """Returns the problem in the fewest states that its optimum depends on."""

    def about_start(self) -> ReducedProblem:
        """Returns the problem in all n states."""


def solve_constrained_ddp(
    problem: Problem,
    guess: FloatArray | None = None,
    state_multiplier: FloatArray | None = None,
    input_multiplier: FloatArray | None = None,
    settings: Settings = Settings(),
) -> Solution:
    """Returns the optimum of a problem.

    Args:
        problem: problem to solve; bounds on states may be linearly dependent.
        guess: (N,m) initial inputs; zero if None.
        state_multiplier: (N+1,K) of an earlier solution; bounds with a positive multiplier start
            in the active set.
        input_multiplier: (N,L) likewise.
        settings: iteration limits and tolerance.
    """
    p = problem
    passes = _prepared(p, guess, state_multiplier, input_multiplier)
    v, on_x, on_v = passes.v, passes.on_x, passes.on_v
    sweeps, interior, converged = 0, 0, False
    if state_multiplier is not None:
        sweeps, converged = passes.sweep(settings.warm_sweeps, settings.max_halvings)
        converged = converged and passes.are_within_price
    if not converged:
        interior, near = _start_inside(passes, guess is not None, settings)
        if near:
            more, converged = _polish(passes, settings)
            sweeps += more
        elif not np.isfinite(v).all():
            v[:], on_x.multiplier[:], on_v.multiplier[:] = 0.0, 0.0, 0.0
    found = passes.of.mapped(v)
    return Solution(
        found,
        p.states(found),
        on_x.multiplier,
        on_v.multiplier,
        p.cost(found),
        p.violation(found),
        sweeps,
        interior,
        bool(converged),
    )


def solve(
    problem: Problem, before: Solution | None = None, settings: Settings = Settings()
) -> Solution:
    """Returns the optimum of a problem, warm-started from an earlier solution if one is given.

    Args:
        problem: problem to solve.
        before: solution of a problem of the same size, such as that of the preceding time step. Its
            inputs are the initial guess, and its active set is tried first.
        settings: iteration limits and tolerance.
    """
    if before is None:
        return solve_constrained_ddp(problem, settings=settings)
    return solve_constrained_ddp(
        problem, before.v, before.state_multiplier, before.input_multiplier, settings
    )


@dataclass(frozen=True)
class _Passes:
    """A reduced problem and its current iterate; arrays change in place.

    Attributes:
        of: the reduced problem, with contiguous arrays.
        price: penalty on the excess of a bound.
        cost: cost of states and inputs.
        on_x, on_v: bounds on states and inputs, with multipliers.
        v: (N,m) inputs. start: (N,m) initial inputs.
        x: (N+1,n) states, filled by the passes.
    """

    of: ReducedProblem
    price: float
    cost: QuadraticCost
    on_x: MeasuredBounds
    on_v: MeasuredBounds
    v: FloatArray
    start: FloatArray
    x: FloatArray

    def sweep(self, most: int, max_halvings: int) -> tuple[int, bool]:
        """Runs up to `most` sweeps; returns their number and whether they converged."""
        sweep: Any = ddp_passes.sweep
        a, b = self.of.a, self.of.b
        if b is None:
            b = np.tile(np.eye(self.v.shape[1]), (len(self.v), 1, 1))
        made, ended = sweep(
            a, b, self.cost, self.on_x, self.on_v, self.v, self.x, most, max_halvings
        )
        return made, ended

    @property
    def are_within_price(self) -> bool:
        """Whether no multiplier exceeds the price of an excess.

        If the bounds barely leave a feasible set, sweeps may end in arbitrarily large multipliers.
        """
        return all(b.multiplier.max(initial=0.0) <= self.price for b in (self.on_x, self.on_v))


def _prepared(
    p: Problem,
    guess: FloatArray | None,
    state_multiplier: FloatArray | None,
    input_multiplier: FloatArray | None,
) -> _Passes:
    """Returns the reduced problem, initialized from an earlier solution if one is given."""
    of = p.reduced().contiguous()
    shape = of.r.shape
    v = np.zeros(shape) if guess is None else np.array(of.unmapped(guess), dtype=np.float64)
    cost = QuadraticCost(of.w, of.w_x, of.r, of.r_v)
    on_x, on_v = _about(of.state_bounds, 1), _about(of.input_bounds, 0)
    if state_multiplier is not None:
        # no input changes x_0, so its bounds are skipped
        on_x.multiplier[1:] = state_multiplier[1:]
    if input_multiplier is not None:
        on_v.multiplier[:] = input_multiplier
    return _Passes(of, p.price, cost, on_x, on_v, v, v.copy(), np.empty(of.w_x.shape))


def _start_inside(passes: _Passes, guessed: bool, settings: Settings) -> tuple[int, bool]:
    """Fills inputs and multipliers by the interior point method, and widens infeasible bounds.

    Returns:
        The number of iterations, and whether the method converged.
    """
    method: Any = interior_point
    on_x, on_v, v, of = passes.on_x, passes.on_v, passes.v, passes.of
    together = [_beside(x[1:], y) for x, y in zip(on_x[:3], on_v[:3], strict=True)]
    n_x = on_x.radius.shape[1]
    multiplier, excess = np.empty(together[2].shape), np.empty(together[2].shape)
    bounds = (*together, n_x)
    given = (of.a, of.b, *passes.cost, *bounds, v, passes.x, multiplier, excess, passes.price)
    starts = [(np.zeros_like(v), settings.max_interior_steps)]
    if guessed:
        starts.insert(0, (passes.start, settings.max_interior_steps // 3))
    total, near = 0, False
    for start, most in starts:
        v[:] = start
        iterations, near = method(*given, most, settings.tolerance)
        total += iterations
        if near:
            break
    on_x.multiplier[1:], on_v.multiplier[:] = multiplier[:, :n_x], multiplier[:, n_x:]
    if near:
        # by the least total excess
        _widen(on_x.radius[1:], excess[:, :n_x])
        _widen(on_v.radius, excess[:, n_x:])
    return total, near


def _beside(of_x: FloatArray, of_v: FloatArray) -> FloatArray:
    """Returns arrays of bounds on states (N,K,…) and on inputs (N,L,…), joined to (N,K+L,…).

    The last dimension of matrices, that of states or inputs, is padded with zeros.
    """
    width = max(of_x.shape[-1], of_v.shape[-1])
    if of_x.ndim < 4:
        return np.concatenate([of_x, of_v], axis=1)
    padded = [np.pad(m, [(0, 0)] * 3 + [(0, width - m.shape[-1])]) for m in (of_x, of_v)]
    return np.concatenate(padded, axis=1)


def _polish(passes: _Passes, settings: Settings) -> tuple[int, bool]:
    """Runs sweeps from the interior point solution, and restores it where they fail.

    Returns:
        The number of sweeps, and whether they converged.
    """
    v, on_x, on_v = passes.v, passes.on_x, passes.on_v
    inside = v.copy(), on_x.multiplier.copy(), on_v.multiplier.copy()
    made, ended = passes.sweep(settings.max_sweeps, settings.max_halvings)
    if not ended:
        v[:] = inside[0]
    if not ended or not passes.are_within_price:
        on_x.multiplier[:], on_v.multiplier[:] = inside[1:]
    return made, ended


def _widen(radius: FloatArray, excess: FloatArray) -> None:
    """Widens bounds (T,K) with an excess t > 0 to √(φ² + 2 φ t), in place."""
    wide = excess > 0.0
    radius[wide] = np.sqrt(radius[wide] * (radius[wide] + 2.0 * excess[wide]))


def _about(bounds: NormBounds, first: int) -> MeasuredBounds:
    """Returns bounds that apply from time step `first` on, not yet evaluated."""
    shape = bounds.radius.shape
    return MeasuredBounds(
        np.ascontiguousarray(bounds.matrix),
        np.ascontiguousarray(bounds.offset),
        np.array(bounds.radius, dtype=np.float64, order="C"),
        first,
        np.zeros((*shape, 3)),
        np.zeros(shape),
        np.full(shape, -np.inf),
        np.zeros(shape, dtype=np.bool_),
        np.zeros(shape),
    )


def feedback_gains(problem: Problem, solution: Solution) -> FloatArray:
    """Returns the feedback gains ∂v/∂x (N,m,n) about a solution, along its active bounds.

    The backward pass uses all n states, not only the m that the inputs reach, because a state
    measured between two solves need not be reachable.
    """
    of = problem.about_start().contiguous()
    (steps, m), n = of.r.shape, of.w_x.shape[1]
    on_x = _at(problem.state_bounds, solution.x, solution.state_multiplier)
    on_v = _at(of.input_bounds, of.unmapped(solution.v), solution.input_multiplier)
    # slopes affect only the feedforward, not the gains
    x_slope, v_slope = np.zeros((steps + 1, n)), np.zeros((steps, m))
    rows = on_x.radius.shape[1] + on_v.radius.shape[1] + n
    backward: Any = ddp_passes.backward
    dropped = 1
    while dropped:
        law = ddp_passes.room(steps, n, m, rows)
        dropped = backward(of.a, of.b, of.w, of.r, x_slope, v_slope, on_x, on_v, law)
        rows += dropped
    return of.mapped(law.gain)


def _at(bounds: NormBounds, z: FloatArray, multiplier: FloatArray) -> MeasuredBounds:
    """Returns bounds evaluated at `z` (T,d), active where the multiplier is positive."""
    found = _about(bounds, 0)
    measure: Any = ddp_passes.measure
    measure(found, z)
    found.active[:] = multiplier > 0.0
    found.multiplier[:] = multiplier
    return found
