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

from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import FloatArray, IntArray
from drake_dress.models.cloth.explicit_bias import ExplicitBiasCloth, Tape
from drake_dress.models.control.budget import Budget, Spending
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


@dataclass(frozen=True)
class Weights:
    """Diagonal weights of the stage costs.

    Attributes:
        position: W, 1/m².
        direction: Q, dimensionless.
        speed: R on the gripper displacement of a step, 1/m².
        safety: w_s on the gripper force beyond `free_force`, 1/N².
        free_force: gripper force that costs nothing, N.
        separation: on the distance of the grippers beyond what the garment between them spans at
            rest, 1/m²; it is what the force would say too late for a descent to hear. Also on
            what it is short of `least_spread` of that, where the garment collapses.
        entering_spread: takes the place of `least_spread` while a sleeve is entered: an armhole is
            held open and turned toward the hand by the garment between the grippers, if it is
            stretched out; a slack one hangs, and is pushed away by the hand.
        level: on what the left gripper is short of being `least_level` of the grippers' distance at
            rest further left than the right one, as the person sees it, 1/m². A garment on edge
            has its openings turned away from both hands, and no way back on its own.
        clearance: on how much closer than `free_clearance` a gripper comes to the person, 1/m².
        free_clearance: distance of a gripper to the person's skin that costs nothing, m.
        corridor: on what hangs ahead of a hand that is to go in, 1/m²; see corridor.py.
        corridor_radius, corridor_length: of the cylinder ahead of it, m.
        passage: on what would cross the forearm if the hand were in the armhole now, 1/m².
        passage_radius, passage_length: of the cylinder that stands for the forearm, m.
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


class GlobalController:
    """Plans gripper velocities over a horizon.

    Args:
        cloth: the controller's garment; its held nodes are those of left, then right gripper.
        held_count: number of nodes held by left and by right gripper.
        armholes: loop nodes of left and right armhole.
        signs: orientation signs of the loops (see `loop_orientation`).
        horizon: N.
        weights: of the costs.
        max_speed: of a gripper, m/s.
        max_iterations: gradient steps per solve.
        span: distance of the grippers at rest, m.
        entry: where arms come into the garment.
        frozen_contact: the gradient takes contact as frozen; the exact one does not descend once
            cloth lies on a limb (see cloth/adjoint.py).
    """

    def __init__(
        self,
        cloth: ExplicitBiasCloth,
        held_count: tuple[int, int],
        armholes: tuple[IntArray, IntArray],
        signs: tuple[float, float],
        horizon: int,
        weights: Weights,
        max_speed: float,
        max_iterations: int,
        span: float,
        entry: Entry,
        frozen_contact: bool = True,
    ) -> None:
        self.cloth = cloth
        self.horizon = horizon
        self.weights = weights
        self.max_speed = max_speed
        self.max_iterations = max_iterations
        self.frozen_contact = frozen_contact
        self._span = span
        self._entry = entry
        self._armholes = armholes
        self._signs = signs
        self._side = np.repeat([0, 1], held_count)
        self._split = [np.flatnonzero(self._side == i) for i in (0, 1)]

    def solve(
        self,
        x: FloatArray,
        v: FloatArray,
        targets: tuple[SleeveTarget, SleeveTarget],
        obstacles: Sequence[Obstacles],
        guess: FloatArray,
        committed_steps: int = 0,
        leftward: FloatArray | None = None,
        budget: Budget = UNLIMITED,
        max_speed: float = np.inf,
    ) -> Plan:
        """Returns the plan that gradient descent reaches from `guess` within a budget.

        The guess is rolled out whatever the budget is. What goes beyond is done where the budget
        has as much left as the last such part took.

        Args:
            x: (n,3) garment now, m.
            v: (n,3) its velocity, m/s.
            targets: of left and right sleeve.
            obstacles: the predicted person at the start of each of the N steps.
            guess: (N,2,3) velocities to start from, m/s.
            committed_steps: the first steps of `guess` that are on their way already and stay.
            leftward: (N,3) horizontal unit vectors to the person's left; None: nothing is level.
            budget: of the solve.
            max_speed: of a gripper in the steps that are not on their way, m/s, where that is less
                than what is allowed ever.
        """
        h, n = self.cloth.time_step, self.horizon
        spending = Spending(budget)
        fastest = np.full((n, 1, 1), self.max_speed)
        fastest[committed_steps:] = min(self.max_speed, max_speed)
        velocity = _limited(guess, fastest)
        now = self._rollout(x, v, velocity, targets, obstacles, leftward)
        rolling = spending.charge(now.iterations())
        descending = rolling
        initial, evaluations, iterations, reason = now.cost, 1, 0, "iterations"
        # A velocity at step j moves every later state: curvature of the position cost.
        remaining = np.arange(n, 0, -1.0)
        scale = 1.0 / (2.0 * h * h * n * (self.weights.position * remaining + self.weights.speed))
        length = 1.0
        while iterations < self.max_iterations:
            if not spending.allows(descending, rolling):
                reason = "budget"
                break
            before = now.iterations()
            gradient = self._gradient(now, velocity, targets, obstacles, leftward)
            descending = spending.charge(now.iterations() - before)
            gradient[:committed_steps] = 0.0
            descent = scale[:, None, None] * gradient
            accepted = afforded = False
            for _ in range(5):
                afforded = spending.allows(rolling)
                if not afforded:
                    break
                trial_velocity = _limited(velocity - length * descent, fastest)
                moved = trial_velocity - velocity
                if np.abs(moved).max() < 1e-3 * self.max_speed:
                    break
                trial = self._rollout(x, v, trial_velocity, targets, obstacles, leftward)
                rolling = spending.charge(trial.iterations())
                evaluations += 1
                if trial.cost < now.cost + 1e-4 * float(np.sum(gradient * moved)):
                    accepted = True
                    break
                length *= 0.4
            if not accepted:
                small = afforded and np.abs(moved).max() < 1e-3 * self.max_speed
                reason = "small_step" if small else "no_descent" if afforded else "budget"
                break
            gained = now.cost - trial.cost
            velocity, now = trial_velocity, trial
            iterations += 1
            length = min(2.0 * length, 8.0)
            if gained < 1e-4 * initial:
                reason = "small_step"
                break
        return Plan(
            velocity,
            now.cost,
            initial,
            iterations,
            evaluations,
            reason,
            now.armhole,
            now.force,
            spending.iterations,
        )

    def _rollout(
        self,
        x: FloatArray,
        v: FloatArray,
        velocity: FloatArray,
        targets: tuple[SleeveTarget, SleeveTarget],
        obstacles: Sequence[Obstacles],
        leftward: FloatArray | None = None,
    ) -> _Rollout:
        h, n, w = self.cloth.time_step, self.horizon, self.weights
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
            cost += w.level * self._level_error(apart, leftward, j) ** 2
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
        self,
        rollout: _Rollout,
        velocity: FloatArray,
        targets: tuple[SleeveTarget, SleeveTarget],
        obstacles: Sequence[Obstacles],
        leftward: FloatArray | None = None,
    ) -> FloatArray:
        h, n, w = self.cloth.time_step, self.horizon, self.weights
        gradient = 2.0 * w.speed * h * h * velocity
        x_bar = np.zeros_like(rollout.states[0])
        v_bar = np.zeros_like(x_bar)
        for j in range(n - 1, -1, -1):
            held_bar = np.zeros((len(self.cloth.held), 3))
            for i in (0, 1):
                t, sleeve = targets[i], rollout.sleeves[j][i]
                p_bar = 2.0 * w.position * t.position_weight * (sleeve.p_c - t.position[j])
                scale = 2.0 * w.direction * t.direction_weight
                if t.entering:
                    state = rollout.states[j]
                    d = entry_direction(state, sleeve.p_c, self._entry)
                    e_bar, c_bar = entry_direction_vjp(
                        state, sleeve.p_c, self._entry, scale * (d - t.direction[j])
                    )
                    x_bar[self._entry.nodes] += e_bar
                    p_bar = p_bar + c_bar
                    d_bar = np.zeros(3)
                else:
                    d_bar = scale * (sleeve.v_c - t.direction[j])
                if t.corridor is not None:
                    x_bar += w.corridor * self._corridor(rollout.states[j], t.corridor, j)[1]
                if t.passage is not None and w.passage > 0.0:
                    crossing = self._passage(rollout.states[j], sleeve.p_c, t.passage[j])[1]
                    x_bar += w.passage * crossing
                    p_bar = p_bar - w.passage * crossing.sum(axis=0)
                loop = self._armholes[i]
                np.add.at(
                    x_bar,
                    loop,
                    sleeve_state_vjp(rollout.states[j], loop, self._signs[i], p_bar, d_bar),
                )
                excess = rollout.force[j, i] - w.free_force
                if excess > 0.0:
                    total = rollout.reaction[j][self._split[i]].sum(axis=0)
                    held_bar[self._split[i]] += (
                        2.0 * w.safety * excess * total / rollout.force[j, i]
                    )
            apart = self._apart(rollout.states[j])
            distance = float(np.linalg.norm(apart))
            error = self._spread_error(distance, targets)
            tilt = self._level_error(apart, leftward, j)
            if error != 0.0 or tilt != 0.0:
                pull = 2.0 * w.separation * error * apart / distance
                if leftward is not None:
                    pull -= 2.0 * w.level * tilt * leftward[j]
                for i, sign in ((0, 1.0), (1, -1.0)):
                    nodes = self.cloth.held[self._split[i]]
                    x_bar[nodes] += sign * pull / len(nodes)
            x_bar[self.cloth.held] += self._clearance(rollout.states[j], obstacles[j])[1]
            back = self.cloth.vector_jacobian_product(
                rollout.tapes[j], x_bar, v_bar, held_bar, frozen_contact=self.frozen_contact
            )
            x_bar, v_bar = back.x, back.v
            for i in (0, 1):
                gradient[j, i] += h * back.held_motion[self._split[i]].sum(axis=0)
        return gradient


def _limited(velocity: FloatArray, max_speed: FloatArray) -> FloatArray:
    """Returns velocities (N,2,3) with none faster than `max_speed` (N,1,1), directions kept."""
    speed = np.linalg.norm(velocity, axis=2, keepdims=True)
    limited: FloatArray = velocity * np.minimum(1.0, max_speed / np.maximum(speed, 1e-12))
    return limited
