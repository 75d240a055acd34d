"""The global controller: gradient descent through the garment (Eq. global_mpc).

A plan is a velocity of each gripper for each of N steps. A rollout of the garment model against the
predicted person gives sleeve states, gripper forces and stage costs of every step. The adjoint of
the rollout, with contact frozen, gives the gradient. The descent is projected onto the speed limit.
The gradient of each velocity is scaled according to the number of steps that it still affects. A
step is accepted only if it lowers the cost sufficiently.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth, Tape
from drake_dress.models.control.budget import Budget, Cost, Spending
from drake_dress.models.control.costs import (
    GarmentCost,
    Grip,
    PlannedStep,
    Weights,
    dressing_costs,
)
from drake_dress.models.control.situation import HeldGarment, Situation
from drake_dress.models.dressing.sleeve import SleeveState, sleeve_state

UNLIMITED = Budget()
# Step lengths tried along one gradient.
_MAX_TRIALS = 5


@dataclass(frozen=True)
class Plan:
    """Result of a solve.

    Attributes:
        velocity: (N,2,3) of left and right gripper, m/s, world.
        cost: final cost; initial_cost: cost of the initial guess.
        iterations: accepted gradient steps; evaluations: rollouts.
        reason: why the descent stopped: "small_step", "no_descent", "iterations" or "budget";
            "search" if the plan was found by trying, "no_plan" if none was requested, "released" if
            the grippers have let go.
        armhole: (N,2,3) predicted armhole centres, m.
        force: (N,2) predicted gripper force, N.
        work: iterations of the linear solver.
    """

    velocity: FloatArray
    cost: float
    initial_cost: float
    iterations: int
    evaluations: int
    reason: str
    armhole: FloatArray
    force: FloatArray
    work: int = 0


@dataclass(frozen=True)
class _Rollout:
    """Rollout of velocities and its cost, with a tape and a planned step for each of N steps."""

    cost: float
    tapes: list[Tape]
    steps: list[PlannedStep]

    @property
    def armhole(self) -> FloatArray:
        """(N,2,3) armhole centres, m."""
        return np.array([[sleeve.p_c for sleeve in step.sleeves] for step in self.steps])

    @property
    def force(self) -> FloatArray:
        """(N,2) forces of the grippers, N."""
        sizes = [[np.linalg.norm(step.force(i)) for i in (0, 1)] for step in self.steps]
        return np.array(sizes, dtype=np.float64)

    def iterations(self) -> int:
        """Returns the linear solver iterations of its steps so far, including gradients."""
        return sum(tape.system.iterations for tape in self.tapes)


@dataclass
class _Search:
    """State of a running descent.

    Attributes:
        velocity: (N,2,3) the best plan so far, m/s.
        now: its rollout.
        fastest: (N,1,1) speed limits, m/s.
        spending: budget spent by the solve.
        rolling: computation cost of the last rollout.
        length: length of the next trial step, relative to the scaled gradient.
        evaluations: rollouts so far.
    """

    velocity: FloatArray
    now: _Rollout
    fastest: FloatArray
    spending: Spending
    rolling: Cost
    length: float = 1.0
    evaluations: int = 1


class GlobalController:
    """Plans gripper velocities over a horizon.

    Args:
        cloth: the controller's garment; its held nodes are those of left, then right gripper.
        garment: its grasp and its openings.
        horizon: number of steps N.
        weights: weights of the costs.
        max_speed: speed limit of a gripper, m/s.
        max_iterations: limit of gradient steps per solve.
        frozen_contact: whether the gradient treats contact as frozen. The exact gradient does not
            lower the cost once cloth lies on a limb (see cloth/explicit/adjoint.py).
        costs: user-defined costs, added to the dressing costs.
    """

    def __init__(
        self,
        cloth: ExplicitBiasCloth,
        garment: HeldGarment,
        horizon: int,
        weights: Weights,
        max_speed: float,
        max_iterations: int,
        frozen_contact: bool = True,
        costs: Sequence[GarmentCost] = (),
    ) -> None:
        self.cloth = cloth
        self.horizon = horizon
        self.weights = weights
        self.max_speed = max_speed
        self.max_iterations = max_iterations
        self.frozen_contact = frozen_contact
        self.costs = dressing_costs(weights, garment, costs)
        self.side_of_held = np.repeat([0, 1], garment.held_count)
        left, right = (np.flatnonzero(self.side_of_held == i) for i in (0, 1))
        self.grip = Grip(cloth.held.astype(np.int64), (left, right), garment.span)

    def solve(
        self,
        situation: Situation,
        guess: FloatArray,
        committed_steps: int = 0,
        budget: Budget = UNLIMITED,
        max_speed: float = np.inf,
    ) -> Plan:
        """Returns the plan that gradient descent reaches from `guess` within a budget.

        The guess is always rolled out. Each further rollout or gradient is computed only if the
        remaining budget covers as much as the last one took.

        Args:
            situation: the garment, the targets and the predicted person.
            guess: (N,2,3) initial velocities, m/s.
            committed_steps: number of first steps of `guess` that are already being executed and
                stay fixed.
            budget: limits of the solve.
            max_speed: speed limit of a gripper in the other steps, m/s, in addition to the
                controller's own limit.
        """
        fastest = np.full((self.horizon, 1, 1), self.max_speed)
        fastest[committed_steps:] = min(self.max_speed, max_speed)
        search = self._begun(situation, _limited(guess, fastest), fastest, Spending(budget))
        spending, descending = search.spending, search.rolling
        initial, iterations, reason = search.now.cost, 0, "iterations"
        scale = self._step_scale()
        while iterations < self.max_iterations:
            if not spending.allows(descending, search.rolling):
                reason = "budget"
                break
            now = search.now
            before = now.iterations()
            gradient = self._gradient(now, search.velocity)
            descending = spending.charge(now.iterations() - before)
            gradient[:committed_steps] = 0.0
            failure = self._advance(search, situation, gradient, scale[:, None, None] * gradient)
            if failure is not None:
                reason = failure
                break
            iterations += 1
            if now.cost - search.now.cost < 1e-4 * initial:
                reason = "small_step"
                break
        return Plan(
            search.velocity,
            search.now.cost,
            initial,
            iterations,
            search.evaluations,
            reason,
            search.now.armhole,
            search.now.force,
            spending.iterations,
        )

    def follow(self, situation: Situation, velocity: FloatArray) -> Plan:
        """Returns the plan of given velocities (N,2,3), m/s, which a search has found."""
        now = self._rollout(situation, velocity)
        return Plan(velocity, now.cost, now.cost, 0, 1, "search", now.armhole, now.force)

    def _begun(
        self, situation: Situation, velocity: FloatArray, fastest: FloatArray, spending: Spending
    ) -> _Search:
        """Returns the search after its first rollout, which is charged to `spending`."""
        now = self._rollout(situation, velocity)
        return _Search(velocity, now, fastest, spending, spending.charge(now.iterations()))

    def _step_scale(self) -> FloatArray:
        """Returns the gradient step length (N,) at each time step, per unit of gradient."""
        h, n = self.cloth.time_step, self.horizon
        # A velocity at step j moves every later state, which sets the curvature of the cost.
        remaining = np.arange(n, 0, -1.0)
        scale: FloatArray = 1.0 / (
            2.0 * h * h * n * (self.weights.position * remaining + self.weights.speed)
        )
        return scale

    def _advance(
        self, search: _Search, situation: Situation, gradient: FloatArray, descent: FloatArray
    ) -> str | None:
        """Takes a backtracking step of the search along minus `descent` (N,2,3).

        Returns:
            None if a step was accepted, otherwise the `reason` of `Plan` why none was.
        """
        for _ in range(_MAX_TRIALS):
            if not search.spending.allows(search.rolling):
                return "budget"
            velocity = _limited(search.velocity - search.length * descent, search.fastest)
            moved = velocity - search.velocity
            if np.abs(moved).max() < 1e-3 * self.max_speed:
                return "small_step"
            trial = self._rollout(situation, velocity)
            search.rolling = search.spending.charge(trial.iterations())
            search.evaluations += 1
            if trial.cost < search.now.cost + 1e-4 * float(np.sum(gradient * moved)):
                search.velocity, search.now = velocity, trial
                search.length = min(2.0 * search.length, 8.0)
                return None
            search.length *= 0.4
        return "no_descent"

    def _rollout(self, situation: Situation, velocity: FloatArray) -> _Rollout:
        """Returns the rollout of velocities (N,2,3), m/s, with its cost."""
        h, n = self.cloth.time_step, self.horizon
        x, v = situation.x, situation.v
        cost = float(self.weights.speed * h * h * np.sum(velocity**2))
        tapes, steps = [], []
        for j in range(n):
            motion = h * velocity[j][self.side_of_held]
            x, v, reaction, tape = self.cloth.step(x, v, motion, situation.obstacles[j])
            tapes.append(tape)
            step = PlannedStep(
                j, x, reaction[self.cloth.held], self._sleeves(x), situation, self.grip
            )
            steps.append(step)
            for value in self.costs.values(step):
                cost += value
        return _Rollout(cost, tapes, steps)

    def _sleeves(self, x: FloatArray) -> tuple[SleeveState, SleeveState]:
        loops, signs = self.costs.armholes, self.costs.signs
        return sleeve_state(x, loops[0], signs[0]), sleeve_state(x, loops[1], signs[1])

    def _gradient(self, rollout: _Rollout, velocity: FloatArray) -> FloatArray:
        """Returns ∂(cost)/∂(velocity) (N,2,3) by the adjoint of a rollout."""
        h = self.cloth.time_step
        gradient = 2.0 * self.weights.speed * h * h * velocity
        x_bar = np.zeros_like(rollout.steps[0].x)
        v_bar = np.zeros_like(x_bar)
        for j in range(self.horizon - 1, -1, -1):
            force_bar = self.costs.add_slope(rollout.steps[j], x_bar)
            back = self.cloth.vector_jacobian_product(
                rollout.tapes[j], x_bar, v_bar, force_bar, frozen_contact=self.frozen_contact
            )
            x_bar, v_bar = back.x, back.v
            for i in (0, 1):
                gradient[j, i] += h * back.held_motion[self.grip.of_side[i]].sum(axis=0)
        return gradient


def _limited(velocity: FloatArray, max_speed: FloatArray) -> FloatArray:
    """Returns velocities (N,2,3) scaled down to at most `max_speed` (N,1,1)."""
    speed = np.linalg.norm(velocity, axis=2, keepdims=True)
    limited: FloatArray = velocity * np.minimum(1.0, max_speed / np.maximum(speed, 1e-12))
    return limited
