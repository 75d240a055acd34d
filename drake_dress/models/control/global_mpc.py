"""The global controller: gradient descent through the garment (Eq. global_mpc).

A plan is a velocity of each gripper for each of N steps. The garment model rolls it out against
the predicted person; sleeve states, stage costs and gripper forces of every step give the cost;
the adjoint of the rollout, contact frozen, gives its gradient. The descent is projected on the
speed limit, each velocity is scaled by the time it has to act, and a step is accepted only if it
lowers the cost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.explicit_bias import ExplicitBiasCloth, Tape
from drake_dress.models.control.budget import Budget, Cost, Spending
from drake_dress.models.control.corridor import Corridor, corridor_cost
from drake_dress.models.dressing.sleeve import (
    Entry,
    SleeveState,
    entry_direction,
    entry_direction_vjp,
    sleeve_state,
    sleeve_state_vjp,
)

UNLIMITED = Budget()
# Step lengths tried along one gradient.
_MAX_TRIALS = 5


@dataclass(frozen=True)
class Weights:
    """Diagonal weights of the stage costs.

    Attributes:
        position: W, weight of a sleeve's distance from its target, 1/m².
        direction: Q, weight of a sleeve's deviation from its direction.
        speed: R, weight of the gripper displacement in a step, 1/m².
        safety: w_s, weight of the gripper force beyond `free_force`, 1/N².
        free_force: gripper force that costs nothing, N.
        separation: weight of the grippers' distance beyond the rest span of the garment between
            them, 1/m². It acts before the garment is taut, when the force does not say anything
            yet. It also weighs what the distance falls short of `least_spread` of that span, where
            the garment collapses.
        least_spread: smallest distance of the grippers that costs nothing, as a share of the rest
            span.
        entering_spread: replaces `least_spread` while a hand enters a sleeve. A stretched garment
            holds the armhole open and turns it to the hand; a slack one hangs, and the hand pushes
            it away.
        level: weight of what the left gripper falls short of being `least_level` of the rest span
            further left than the right one, as the person sees it, 1/m². A garment on edge turns
            its openings away from both hands and does not come back by itself.
        least_level: lateral lead of the left gripper that costs nothing, as a share of the rest
            span.
        clearance: weight of how much closer than `free_clearance` a gripper is to the person, 1/m².
        free_clearance: distance of a gripper from the person's skin that costs nothing, m.
        corridor: weight of cloth that hangs ahead of a hand about to enter, 1/m²; see corridor.py.
        corridor_radius: radius of the cylinder ahead of that hand, m.
        corridor_length: length of the cylinder ahead of that hand, m.
        passage: weight of cloth that would cross the forearm if the hand were in the armhole now,
            1/m².
        passage_radius: radius of the cylinder that stands for the forearm, m.
        passage_length: length of the cylinder that stands for the forearm, m.
    """

    position: float = 1.0
    direction: float = 0.05
    speed: float = 0.125
    safety: float = 3e-4
    free_force: float = 5.0
    separation: float = 1.0
    least_spread: float = 0.5
    entering_spread: float = 0.85
    level: float = 20.0
    least_level: float = 0.5
    clearance: float = 10.0
    free_clearance: float = 0.05
    corridor: float = 3.0
    corridor_radius: float = 0.06
    corridor_length: float = 0.12
    passage: float = 3.0
    passage_radius: float = 0.06
    passage_length: float = 0.25


@dataclass(frozen=True)
class SleeveTarget:
    """Where one sleeve shall be at each of the N steps.

    Attributes:
        position: (N,3) m; direction: (N,3) unit vectors.
        position_weight, direction_weight: factors on W and Q; 0 leaves the sleeve alone.
        entering: the direction asked for is that from the armhole to the garment's entry, not the
            armhole's own.
        corridor: ahead of the hand that is to go in, if it is near.
        passage: (N,3) unit vectors from elbow to hand of the arm that is to go in.
    """

    position: FloatArray
    direction: FloatArray
    position_weight: float = 1.0
    direction_weight: float = 1.0
    entering: bool = False
    corridor: Corridor | None = None
    passage: FloatArray | None = None


@dataclass(frozen=True)
class Situation:
    """The garment now, its targets, and the predicted person.

    Attributes:
        x: (n,3) garment now, m.
        v: (n,3) its velocity, m/s.
        targets: of left and right sleeve.
        obstacles: the predicted person at the start of each of the N steps.
        leftward: (N,3) horizontal unit vectors to the person's left; if None, the grippers' level
            costs nothing.
    """

    x: FloatArray
    v: FloatArray
    targets: tuple[SleeveTarget, SleeveTarget]
    obstacles: Sequence[Obstacles]
    leftward: FloatArray | None = None


@dataclass(frozen=True)
class HeldGarment:
    """How the controller's garment is held, and where its openings are.

    Attributes:
        held_count: number of nodes held by left and by right gripper.
        armholes: loop nodes of left and right armhole.
        signs: orientation signs of the loops (see `loop_orientation`).
        span: distance of the grippers at rest, m.
        entry: where arms come into the garment.
    """

    held_count: tuple[int, int]
    armholes: tuple[IntArray, IntArray]
    signs: tuple[float, float]
    span: float
    entry: Entry


@dataclass(frozen=True)
class Plan:
    """Result of a solve.

    Attributes:
        velocity: (N,2,3) of left and right gripper, m/s, world.
        cost: reached; initial_cost: of the start.
        iterations: accepted gradient steps; evaluations: rollouts.
        reason: why the descent stopped: "small_step", "no_descent", "iterations" or "budget";
            "no_plan" if none was asked for.
        armhole: (N,2,3) predicted armhole centres, m.
        force: (N,2) predicted gripper force, N.
        work: iterations of linear solves that it took.
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
    cost: float
    tapes: list[Tape]
    states: list[FloatArray]
    armhole: FloatArray
    reaction: list[FloatArray]
    sleeves: list[tuple[SleeveState, SleeveState]]
    force: FloatArray

    def iterations(self) -> int:
        """Returns those of the linear solves of its steps so far, those of gradients counted."""
        return sum(tape.system.iterations for tape in self.tapes)


@dataclass
class _Search:
    """A descent under way.

    Attributes:
        velocity: (N,2,3) the best plan so far, m/s.
        now: its rollout.
        fastest: (N,1,1) speed limits, m/s.
        spending: of the solve.
        rolling: what the last rollout took.
        length: of the next trial step, relative to the scaled gradient.
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
        garment: how it is held, and its openings.
        horizon: N.
        weights: of the costs.
        max_speed: of a gripper, m/s.
        max_iterations: gradient steps per solve.
        frozen_contact: the gradient takes contact as frozen; the exact one does not descend once
            cloth lies on a limb (see cloth/adjoint.py).
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
    ) -> None:
        self.cloth = cloth
        self.horizon = horizon
        self.weights = weights
        self.max_speed = max_speed
        self.max_iterations = max_iterations
        self.frozen_contact = frozen_contact
        self._span = garment.span
        self._entry = garment.entry
        self._armholes = garment.armholes
        self._signs = garment.signs
        self._side = np.repeat([0, 1], garment.held_count)
        self._split = [np.flatnonzero(self._side == i) for i in (0, 1)]

    def solve(
        self,
        situation: Situation,
        guess: FloatArray,
        committed_steps: int = 0,
        budget: Budget = UNLIMITED,
        max_speed: float = np.inf,
    ) -> Plan:
        """Returns the plan that gradient descent reaches from `guess` within a budget.

        The guess is rolled out whatever the budget is. Each further rollout or gradient is computed
        only if the budget has as much left as the last one took.

        Args:
            situation: the garment, the targets and the predicted person.
            guess: (N,2,3) velocities to start from, m/s.
            committed_steps: the first steps of `guess` that are already under way and stay.
            budget: of the solve.
            max_speed: of a gripper in the steps that are not under way, m/s; it applies where it is
                less than the controller's own limit.
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
            gradient = self._gradient(now, search.velocity, situation)
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

    def _begun(
        self, situation: Situation, velocity: FloatArray, fastest: FloatArray, spending: Spending
    ) -> _Search:
        """Returns the search with its first rollout done and charged."""
        now = self._rollout(situation, velocity)
        return _Search(velocity, now, fastest, spending, spending.charge(now.iterations()))

    def _step_scale(self) -> FloatArray:
        """Returns (N,) the length of a gradient step at each time step, per unit of gradient."""
        h, n = self.cloth.time_step, self.horizon
        # A velocity at step j moves every later state: curvature of the position cost.
        remaining = np.arange(n, 0, -1.0)
        scale: FloatArray = 1.0 / (
            2.0 * h * h * n * (self.weights.position * remaining + self.weights.speed)
        )
        return scale

    def _advance(
        self, search: _Search, situation: Situation, gradient: FloatArray, descent: FloatArray
    ) -> str | None:
        """Moves the search along minus `descent` (N,2,3), as far as that lowers the cost.

        Returns:
            None if a step was accepted, otherwise why none was: a `reason` of `Plan`.
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
        """Returns where velocities (N,2,3) lead, m/s, and what that costs."""
        h, n, w = self.cloth.time_step, self.horizon, self.weights
        x, v, targets, obstacles = (
            situation.x,
            situation.v,
            situation.targets,
            situation.obstacles,
        )
        cost = float(w.speed * h * h * np.sum(velocity**2))
        tapes, states, reactions, sleeves = [], [], [], []
        armhole, force = np.empty((n, 2, 3)), np.empty((n, 2))
        for j in range(n):
            motion = h * velocity[j][self._side]
            x, v, reaction, tape = self.cloth.step(x, v, motion, obstacles[j])
            tapes.append(tape)
            states.append(x)
            held = reaction[self.cloth.held]
            reactions.append(held)
            pair = []
            for i in (0, 1):
                sleeve = sleeve_state(x, self._armholes[i], self._signs[i])
                pair.append(sleeve)
                armhole[j, i] = sleeve.p_c
                t = targets[i]
                cost += (
                    w.position
                    * t.position_weight
                    * float(np.sum((sleeve.p_c - t.position[j]) ** 2))
                )
                d = entry_direction(x, sleeve.p_c, self._entry) if t.entering else sleeve.v_c
                cost += w.direction * t.direction_weight * float(np.sum((d - t.direction[j]) ** 2))
                if t.corridor is not None:
                    cost += w.corridor * self._corridor(x, t.corridor, j)[0]
                if t.passage is not None and w.passage > 0.0:
                    cost += w.passage * self._passage(x, sleeve.p_c, t.passage[j])[0]
                force[j, i] = np.linalg.norm(held[self._split[i]].sum(axis=0))
                cost += w.safety * max(0.0, force[j, i] - w.free_force) ** 2
            sleeves.append((pair[0], pair[1]))
            apart = self._apart(x)
            cost += w.separation * self._spread_error(float(np.linalg.norm(apart)), targets) ** 2
            cost += w.level * self._level_error(apart, situation.leftward, j) ** 2
            cost += self._clearance(x, obstacles[j])[0]
        return _Rollout(cost, tapes, states, armhole, reactions, sleeves, force)

    def _apart(self, x: FloatArray) -> FloatArray:
        """Returns the vector (3,) from the right to the left grasp, m."""
        left, right = (x[self.cloth.held[self._split[i]]].mean(axis=0) for i in (0, 1))
        apart: FloatArray = left - right
        return apart

    def _spread_error(self, distance: float, targets: tuple[SleeveTarget, SleeveTarget]) -> float:
        """Returns how far, m, grippers are too far apart (positive) or too close (negative)."""
        w = self.weights
        entering = any(t.entering and t.position_weight > 0.0 for t in targets)
        short = distance - (w.entering_spread if entering else w.least_spread) * self._span
        return max(0.0, distance - self._span) + min(0.0, short)

    def _level_error(self, apart: FloatArray, leftward: FloatArray | None, j: int) -> float:
        """Returns how far, m, the left gripper is short of being left of the right one."""
        if leftward is None:
            return 0.0
        return max(0.0, self.weights.least_level * self._span - float(apart @ leftward[j]))

    def _corridor(self, x: FloatArray, way: Corridor, j: int) -> tuple[float, FloatArray]:
        w = self.weights
        return corridor_cost(x, way.hand[j], way.into[j], w.corridor_radius, w.corridor_length)

    def _passage(
        self, x: FloatArray, center: FloatArray, into: FloatArray
    ) -> tuple[float, FloatArray]:
        w = self.weights
        return corridor_cost(x, center, -into, w.passage_radius, w.passage_length)

    def _clearance(self, x: FloatArray, obstacles: Obstacles) -> tuple[float, FloatArray]:
        """Returns the cost of grippers close to the person, and its derivative by held nodes."""
        w, count = self.weights, np.array([len(s) for s in self._split])[self._side]
        if not obstacles.count:
            return 0.0, np.zeros((len(count), 3))
        near = find_proximity(x[self.cloth.held], obstacles, w.free_clearance)
        short = np.maximum(0.0, -near.gap)
        cost = w.clearance * float(np.sum(short**2 / count))
        return cost, (-2.0 * w.clearance * short / count * near.slope)[:, None] * near.normal

    def _gradient(
        self, rollout: _Rollout, velocity: FloatArray, situation: Situation
    ) -> FloatArray:
        """Returns ∂(cost)/∂(velocity) (N,2,3) by the adjoint of a rollout."""
        h, n, w = self.cloth.time_step, self.horizon, self.weights
        gradient = 2.0 * w.speed * h * h * velocity
        x_bar = np.zeros_like(rollout.states[0])
        v_bar = np.zeros_like(x_bar)
        for j in range(n - 1, -1, -1):
            x = rollout.states[j]
            for i in (0, 1):
                self._add_sleeve_slope(x_bar, rollout, situation.targets[i], j, i)
            self._add_spread_slope(x_bar, x, situation, j)
            x_bar[self.cloth.held] += self._clearance(x, situation.obstacles[j])[1]
            back = self.cloth.vector_jacobian_product(
                rollout.tapes[j],
                x_bar,
                v_bar,
                self._force_slope(rollout, j),
                frozen_contact=self.frozen_contact,
            )
            x_bar, v_bar = back.x, back.v
            for i in (0, 1):
                gradient[j, i] += h * back.held_motion[self._split[i]].sum(axis=0)
        return gradient

    def _add_sleeve_slope(
        self, x_bar: FloatArray, rollout: _Rollout, target: SleeveTarget, j: int, i: int
    ) -> None:
        """Adds to `x_bar` (n,3) the derivative of what sleeve `i` costs at step `j`."""
        w, x, sleeve = self.weights, rollout.states[j], rollout.sleeves[j][i]
        p_bar = 2.0 * w.position * target.position_weight * (sleeve.p_c - target.position[j])
        d_bar = np.zeros(3)
        scale = 2.0 * w.direction * target.direction_weight
        if target.entering:
            d = entry_direction(x, sleeve.p_c, self._entry)
            e_bar, c_bar = entry_direction_vjp(
                x, sleeve.p_c, self._entry, scale * (d - target.direction[j])
            )
            x_bar[self._entry.nodes] += e_bar
            p_bar = p_bar + c_bar
        else:
            d_bar = scale * (sleeve.v_c - target.direction[j])
        if target.corridor is not None:
            x_bar += w.corridor * self._corridor(x, target.corridor, j)[1]
        if target.passage is not None and w.passage > 0.0:
            crossing = self._passage(x, sleeve.p_c, target.passage[j])[1]
            x_bar += w.passage * crossing
            p_bar = p_bar - w.passage * crossing.sum(axis=0)
        loop = self._armholes[i]
        np.add.at(x_bar, loop, sleeve_state_vjp(x, loop, self._signs[i], p_bar, d_bar))

    def _force_slope(self, rollout: _Rollout, j: int) -> FloatArray:
        """Returns (k,3) the derivative of the force cost of step `j` by the held reactions."""
        w = self.weights
        slope = np.zeros((len(self.cloth.held), 3))
        for i in (0, 1):
            excess = rollout.force[j, i] - w.free_force
            if excess > 0.0:
                total = rollout.reaction[j][self._split[i]].sum(axis=0)
                slope[self._split[i]] += 2.0 * w.safety * excess * total / rollout.force[j, i]
        return slope

    def _add_spread_slope(
        self, x_bar: FloatArray, x: FloatArray, situation: Situation, j: int
    ) -> None:
        """Adds to `x_bar` (n,3) the derivative of what the grippers' distance and level cost."""
        w, leftward = self.weights, situation.leftward
        apart = self._apart(x)
        distance = float(np.linalg.norm(apart))
        error = self._spread_error(distance, situation.targets)
        tilt = self._level_error(apart, leftward, j)
        if error == 0.0 and tilt == 0.0:
            return
        pull = 2.0 * w.separation * error * apart / distance
        if leftward is not None:
            pull -= 2.0 * w.level * tilt * leftward[j]
        for i, sign in ((0, 1.0), (1, -1.0)):
            nodes = self.cloth.held[self._split[i]]
            x_bar[nodes] += sign * pull / len(nodes)


def _limited(velocity: FloatArray, max_speed: FloatArray) -> FloatArray:
    """Returns velocities (N,2,3) with none faster than `max_speed` (N,1,1), directions kept."""
    speed = np.linalg.norm(velocity, axis=2, keepdims=True)
    limited: FloatArray = velocity * np.minimum(1.0, max_speed / np.maximum(speed, 1e-12))
    return limited
