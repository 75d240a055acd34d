"""Constrained differential dynamic programming (Alg. cddp) for linear-quadratic problems.

Backward pass: the cost-to-go is a quadratic of the state. Active bounds are linear in the step's
state and input; what of them no input can change, the null space, is a condition on the state and
is handed to the step before (Eq. future-constraint). Forward pass: the feedback law gives a new
trajectory and the bounds' multipliers, which travel the other way: a condition that was handed to
an earlier step hands its multiplier back. Bounds with a negative multiplier are let go, bounds that
the new trajectory exceeds are taken in (Eq. sigma_j), and the step is shortened until cost and
excess together fall.

Three things are more than the print has, each for a reason. Rows carry what is missing to their
bound, as a tangent plane alone drifts off a ball. A ball's curvature, weighted by its multiplier,
is part of the cost: with it the passes converge quadratically and end on the bounds to rounding.
And rows that depend on each other are dropped, as seven bounds on six inputs may be.
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
    """When to give up.

    Attributes:
        warm_sweeps: backward and forward passes from an earlier solution's multipliers, before the
            interior point method is asked.
        max_sweeps: such passes after it.
        max_halvings: of a step that does not lower cost and excess.
        max_interior_steps: of the interior point method; from a guess a third of them.
        tolerance: at which that one ends, see `interior_point`.
    """

    warm_sweeps: int = 4
    max_sweeps: int = 20
    max_halvings: int = 12
    max_interior_steps: int = 120
    tolerance: float = 1e-8


class Problem(Protocol):
    """What can be solved: `LocalProblem`, `LinearQuadraticProblem`."""

    @property
    def state_bounds(self) -> NormBounds:
        """On x_0 … x_N."""

    @property
    def price(self) -> float:
        """Of the sum of all excesses."""

    def states(self, v: FloatArray) -> FloatArray:
        """Returns (N+1,n) the states that inputs `v` (N,m) lead to."""

    def cost(self, v: FloatArray) -> float:
        """Returns the cost of inputs `v` (N,m)."""

    def violation(self, v: FloatArray) -> float:
        """Returns by how much inputs `v` (N,m) exceed the worst bound; 0 if none."""

    def reduced(self) -> ReducedProblem:
        """Returns it in the fewest states that its optimum needs."""

    def about_start(self) -> ReducedProblem:
        """Returns it in all n states."""


def solve_constrained_ddp(
    problem: Problem,
    guess: FloatArray | None = None,
    state_multiplier: FloatArray | None = None,
    input_multiplier: FloatArray | None = None,
    settings: Settings = Settings(),
) -> Solution:
    """Returns the optimum of a problem.

    Args:
        problem: to solve; bounds on states may depend on each other.
        guess: (N,m) inputs to start from; zero if None.
        state_multiplier: (N+1,K) of an earlier solution; positive ones start as active.
        input_multiplier: (N,L) likewise.
        settings: when to give up.
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
    """Returns the optimum of a problem, from the solution of a similar one if there is one.

    Args:
        problem: to solve.
        before: of a problem of the same size, such as that of a moment ago: its inputs are the
            start, and its active bounds are tried first.
        settings: when to give up.
    """
    if before is None:
        return solve_constrained_ddp(problem, settings=settings)
    return solve_constrained_ddp(
        problem, before.v, before.state_multiplier, before.input_multiplier, settings
    )


@dataclass(frozen=True)
class _Passes:
    """A problem in the coordinates of the passes, and the solution so far; arrays change in place.

    Attributes:
        of: the problem, with contiguous arrays.
        price: of the excess of a bound.
        cost: of states and inputs.
        on_x, on_v: bounds on states and inputs, with multipliers.
        v: (N,m) inputs. start: (N,m) those that were given.
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
        """Makes passes; returns how many, and whether they ended at an optimum."""
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
        """Whether no multiplier is beyond the price of an excess.

        Of bounds that only just leave room, sweeps may end on multipliers beyond all measure.
        """
        return all(b.multiplier.max(initial=0.0) <= self.price for b in (self.on_x, self.on_v))


def _prepared(
    p: Problem,
    guess: FloatArray | None,
    state_multiplier: FloatArray | None,
    input_multiplier: FloatArray | None,
) -> _Passes:
    """Returns a problem for the passes, with what an earlier solution suggests."""
    of = p.reduced().contiguous()
    shape = of.r.shape
    v = np.zeros(shape) if guess is None else np.array(of.unmapped(guess), dtype=np.float64)
    cost = QuadraticCost(of.w, of.w_x, of.r, of.r_v)
    on_x, on_v = _about(of.state_bounds, 1), _about(of.input_bounds, 0)
    if state_multiplier is not None:
        # those of the start are passed over
        on_x.multiplier[1:] = state_multiplier[1:]
    if input_multiplier is not None:
        on_v.multiplier[:] = input_multiplier
    return _Passes(of, p.price, cost, on_x, on_v, v, v.copy(), np.empty(of.w_x.shape))


def _start_inside(passes: _Passes, guessed: bool, settings: Settings) -> tuple[int, bool]:
    """Fills inputs and multipliers by the interior point method, and widens what nothing keeps.

    Returns:
        Its iterations, and whether they sufficed.
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
        # by as little as can be
        _widen(on_x.radius[1:], excess[:, :n_x])
        _widen(on_v.radius, excess[:, n_x:])
    return total, near


def _beside(of_x: FloatArray, of_v: FloatArray) -> FloatArray:
    """Returns parts of bounds on states and on inputs, (N,K,…) and (N,L,…), as (N,K+L,…).

    The last dimension of matrices, that of states or inputs, is filled up with zeros.
    """
    width = max(of_x.shape[-1], of_v.shape[-1])
    if of_x.ndim < 4:
        return np.concatenate([of_x, of_v], axis=1)
    padded = [np.pad(m, [(0, 0)] * 3 + [(0, width - m.shape[-1])]) for m in (of_x, of_v)]
    return np.concatenate(padded, axis=1)


def _polish(passes: _Passes, settings: Settings) -> tuple[int, bool]:
    """Makes passes from where the interior point method ended, and takes back what is worse.

    Returns:
        How many, and whether they ended at an optimum.
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
    """Widens bounds (T,K) in place to √(φ² + 2 φ t), those with no excess t not at all."""
    wide = excess > 0.0
    radius[wide] = np.sqrt(radius[wide] * (radius[wide] + 2.0 * excess[wide]))


def _about(bounds: NormBounds, first: int) -> MeasuredBounds:
    """Returns bounds that hold from time `first` on, of which nothing is measured yet."""
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
    """Returns (N,m,n) ∂v/∂x about a solution, along the bounds that are active there.

    It is a backward pass with all n states, not only those m that the inputs reach: what is
    measured between two solves need not lie among them.
    """
    of = problem.about_start().contiguous()
    (steps, m), n = of.r.shape, of.w_x.shape[1]
    on_x = _at(problem.state_bounds, solution.x, solution.state_multiplier)
    on_v = _at(of.input_bounds, of.unmapped(solution.v), solution.input_multiplier)
    # gains do not depend on slopes, which only move the feedforward
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
    """Returns bounds about a solution `z` (T,d)."""
    found = _about(bounds, 0)
    measure: Any = ddp_passes.measure
    measure(found, z)
    found.active[:] = multiplier > 0.0
    found.multiplier[:] = multiplier
    return found
