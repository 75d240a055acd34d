"""From what is seen to a plan: sleeve states, stages, targets and the global controller in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import FloatArray, make_elements
from drake_dress.models.cloth.explicit_bias import ExplicitBiasCloth
from drake_dress.models.cloth.material import Material
from drake_dress.models.control.global_mpc import GlobalController, Plan, SleeveTarget, Weights
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.dressing.linking import arm_linking_number
from drake_dress.models.dressing.sight import free_sight
from drake_dress.models.dressing.sleeve import (
    SleeveState,
    find_entry,
    loop_orientation,
    sleeve_state,
)
from drake_dress.models.dressing.stages import (
    SleeveFacts,
    StageParameters,
    StageState,
    Task,
    advance_stages,
    eases,
    retreats,
)
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.body import Capsule
from drake_dress.models.human.heading import Heading, heading
from drake_dress.models.sides import SIDES


@dataclass(frozen=True)
class PolicyParameters:
    """Settings of the global controller and its targets.

    Attributes:
        time_step: of the prediction, s. horizon: N. max_iterations: gradient steps per solve.
        inner_iterations: of the garment's linear solve; 1 is the paper's one-step scheme.
        committed_steps: of a plan, which run before it can be used.
        max_speed: of a gripper, m/s.
        weights: of the costs.
        progress_step: advance of s asked for in one step of the prediction (k).
        approach_distance: cap of l_h, m.
        tethered_approach_distance: the same with the other sleeve on, m.
        approach_slope: l_h per distance beside the line of approach; 1 as printed.
        approach_share: direction in which an armhole is drawn over the hand, between inward across
            the body (0) and the forearm (1).
        orientation_share: direction from the armhole to the garment's entry, likewise.
        behind_distance: cap of how far behind the hand a sleeve that is not in line yet waits, m.
        tethered_behind_distance: the same with the other sleeve on, m.
        retreat_distance: how much further back a sleeve goes that missed the hand, m.
        widening: growth of the cap of l_h with each attempt that missed the hand.
        least_sight: share of an opening that the hand has to see for it to be drawn over.
        aside_free: distance beside that does not count, m.
        overshoot: how far past the hand an armhole in line is asked to go, m.
        inside_radius: a hand beyond an armhole's plane and this close to its centre is in it, m.
        dressing_direction: factor on Q while a sleeve is drawn up its arm.
        waiting_reach: share of the distance between both armholes at rest that a waiting sleeve
            lets the other one use.
        final_progress: s that is asked for in the end; at 2 the armhole would be drawn into the
            armpit, and both sleeves would pull against each other.
        largest_lead: advance of s that one of two sleeves on their arms may have on the other.
        stages: thresholds of the switching.
    """

    time_step: float = 0.1
    horizon: int = 8
    max_iterations: int = 4
    inner_iterations: int = 10
    committed_steps: int = 2
    max_speed: float = 0.12
    weights: Weights = field(default_factory=Weights)
    progress_step: float = 0.04
    approach_distance: float = 0.20
    tethered_approach_distance: float = 0.15
    approach_slope: float = 3.0
    approach_share: float = 0.25
    orientation_share: float = 0.6
    behind_distance: float = 0.30
    tethered_behind_distance: float = 0.15
    retreat_distance: float = 0.15
    widening: float = 0.1
    least_sight: float = 0.5
    aside_free: float = 0.02
    overshoot: float = 0.12
    inside_radius: float = 0.08
    dressing_direction: float = 0.1
    waiting_reach: float = 0.9
    final_progress: float = 1.99
    largest_lead: float = 0.6
    stages: StageParameters = field(default_factory=StageParameters)


@dataclass(frozen=True)
class PersonModel:
    """What the controller knows of the person's shape.

    Attributes:
        capsules: in body frames; those of the torso go with the shoulders.
        shoulders: (2,3) of the shoulder joints in the torso's frame, left and right, m.
        radius: upper arm, forearm, hand, m.
    """

    capsules: tuple[Capsule, ...]
    shoulders: FloatArray
    radius: tuple[float, float, float]


@dataclass(frozen=True)
class PolicyState:
    """What is carried from one decision to the next."""

    stages: StageState
    velocity: FloatArray


@dataclass(frozen=True)
class Decision:
    """A plan and what led to it; `target` (2,3) is where the armholes shall be next, m."""

    plan: Plan
    tasks: tuple[Task, Task]
    facts: tuple[SleeveFacts, SleeveFacts]
    target: FloatArray


class DressingPolicy:
    """Decides how both grippers move, from garment and person as they are believed to be.

    Args:
        mesh: the controller's garment; it need not be the true one.
        material: what the controller believes of the fabric.
        person: what it knows of the person's shape.
        parameters: settings.
    """

    def __init__(
        self,
        mesh: GarmentMesh,
        material: Material,
        person: PersonModel,
        parameters: PolicyParameters,
    ) -> None:
        self.mesh = mesh
        self.parameters = parameters
        self._person = person
        elements = make_elements(mesh.rest_position, mesh.faces)
        held = np.concatenate([mesh.grasp[side] for side in SIDES])
        cloth = ExplicitBiasCloth(
            elements,
            material,
            parameters.time_step,
            held,
            tolerance=1e-2,
            iterations=parameters.inner_iterations,
        )
        self._loops = tuple(np.asarray(mesh.loops[f"{side}_armhole"]) for side in SIDES)
        self._signs = tuple(float(loop_orientation(mesh, side)) for side in SIDES)
        left, right = (mesh.rest_position[mesh.grasp[side]].mean(axis=0) for side in SIDES)
        centers = [mesh.rest_position[loop].mean(axis=0) for loop in self._loops]
        self._reach = float(np.linalg.norm(centers[0] - centers[1]))
        span = float(np.linalg.norm(left - right))
        self._entry = find_entry(mesh)
        self.controller = GlobalController(
            cloth,
            (len(mesh.grasp["left"]), len(mesh.grasp["right"])),
            (self._loops[0], self._loops[1]),
            (self._signs[0], self._signs[1]),
            parameters.horizon,
            parameters.weights,
            parameters.max_speed,
            parameters.max_iterations,
            span,
            self._entry,
        )

    def initial_state(self) -> PolicyState:
        """Returns the state before the first decision: nothing is on, nothing moves."""
        return PolicyState(StageState(), np.zeros((self.parameters.horizon, 2, 3)))

    def decide(
        self,
        state: PolicyState,
        x: FloatArray,
        v: FloatArray,
        joints: FloatArray,
        time: float,
        elapsed_steps: int = 5,
    ) -> tuple[PolicyState, Decision]:
        """Returns the next state and the decision.

        Args:
            state: of the decision before.
            x: (n,3) the controller's garment, m.
            v: (n,3) its velocity, m/s.
            joints: (N+1,6,3) predicted shoulder, elbow, hand of left, then right arm, m; row 0
                is now.
            time: now, s.
            elapsed_steps: how many prediction steps passed since the last decision, for the start
                of the descent.
        """
        p = self.parameters
        axes = [
            [ArmAxis(hand=q[3 * i + 2], elbow=q[3 * i + 1], shoulder=q[3 * i]) for q in joints]
            for i in (0, 1)
        ]
        headings = [heading(q) for q in joints]
        sleeves = [sleeve_state(x, self._loops[i], self._signs[i]) for i in (0, 1)]
        facts = (
            self._facts(x, joints[0], axes[0][0], headings[0], sleeves[0], 0),
            self._facts(x, joints[0], axes[1][0], headings[0], sleeves[1], 1),
        )
        goals = [self._waypoint(axes[i][0], headings[0], facts[i], i) for i in (0, 1)]
        distance = float(np.linalg.norm(goals[0] - goals[1]))
        stages, tasks = advance_stages(state.stages, facts, p.stages, distance, time)
        targets = [
            self._target(
                tasks,
                i,
                axes,
                headings,
                facts,
                sleeves,
                retreats(stages, i, p.stages, time),
                eases(stages, i, p.stages, time),
                stages.attempts,
            )
            for i in (0, 1)
        ]
        obstacles = self._obstacles(joints)
        guess = np.concatenate(
            [state.velocity[elapsed_steps:], np.repeat(state.velocity[-1:], elapsed_steps, axis=0)]
        )[: p.horizon]
        plan = self.controller.solve(
            x, v, (targets[0], targets[1]), obstacles, guess, p.committed_steps
        )
        decision = Decision(plan, tasks, facts, np.stack([targets[i].position[-1] for i in (0, 1)]))
        return replace(state, stages=stages, velocity=plan.velocity), decision

    def _approach_direction(self, axis: ArmAxis, to: Heading, side: int) -> FloatArray:
        """Returns the unit vector along which an armhole is drawn over the hand."""
        return _between(_inward(to, side), axis.D(0.0), self.parameters.approach_share)

    def _waypoint(self, axis: ArmAxis, to: Heading, fact: SleeveFacts, side: int) -> FloatArray:
        """Returns where a sleeve has to be able to go next: outside the hand, or up its arm."""
        p = self.parameters
        if fact.linked:
            return axis.G(min(2.0, fact.s + p.progress_step))
        return axis.G(0.0) - p.approach_distance * self._approach_direction(axis, to, side)

    def _facts(
        self,
        x: FloatArray,
        joints: FloatArray,
        axis: ArmAxis,
        to: Heading,
        sleeve: SleeveState,
        side: int,
    ) -> SleeveFacts:
        shoulder, elbow, hand = joints[3 * side : 3 * side + 3]
        interior = 0.5 * (joints[0] + joints[3]) - np.array([0.0, 0.0, 0.1])
        linked = abs(arm_linking_number(x[self._loops[side]], shoulder, elbow, hand, interior)) == 1
        s, _, _ = axis.coordinates(sleeve.p_c)
        offset = hand - sleeve.p_c
        aside = _aside(offset, self._approach_direction(axis, to, side))
        sight = free_sight(x, self.mesh.faces, self._loops[side], hand)
        return SleeveFacts(
            linked=linked,
            in_sight=sight >= self.parameters.least_sight,
            s=float(s) if linked else 0.0,
            hand_distance=float(np.linalg.norm(offset)),
            prepared_error=max(aside, 0.5 * float(np.linalg.norm(offset))),
            passed=0.0 if linked else float(s) * float(np.linalg.norm(elbow - hand)),
            opening=float(axis.D(0.0) @ _inward(to, side)),
        )

    def _prepared(
        self,
        axis: ArmAxis,
        to: Heading,
        sleeve: SleeveState,
        side: int,
        tethered: bool,
        in_sight: bool,
        retreat: bool = False,
        attempts: int = 0,
    ) -> FloatArray:
        """Returns where a sleeve is prepared (Eq. Jpi).

        The opening is drawn over the hand mostly from outside inward. Before, it waits a cap of l_h
        outside the hand, and further back (against v_f) until it is in line: so the hand comes in
        by the open front. An arm that comes from anywhere else meets the outside of the front
        panel, with the armhole's centre at the hand and the hand not in it; so an opening that the
        hand does not see stays outside. One that faces the hand is drawn along its own normal, and
        along the forearm once the hand is in it: further inward it would be pulled past the hand.
        """
        p = self.parameters
        hand = axis.G(0.0)
        direction = self._approach_direction(axis, to, side)
        offset = hand - sleeve.p_c
        # Depth of the hand behind the opening, and how far it is beside the opening's normal.
        depth = float(offset @ -sleeve.v_c)
        beside = float(np.linalg.norm(offset + depth * sleeve.v_c))
        facing = _ramp(beside, 1.5 * p.inside_radius, p.inside_radius) if in_sight else 0.0
        inside = facing * _ramp(depth, -0.02, 0.02)
        aside = (1.0 - facing) * _aside(offset, direction)
        cap = p.tethered_approach_distance if tethered else p.approach_distance
        cap *= 1.0 + p.widening * min(attempts, 3)
        distance = min(p.approach_slope * max(0.0, aside - p.aside_free), cap)
        if not in_sight:
            distance = cap
        if retreat:
            return hand - cap * direction - p.retreat_distance * to.front
        onward = (1.0 - facing) * direction + (facing - inside) * sleeve.v_c + inside * axis.D(0.0)
        goal = hand - distance * direction + p.overshoot * onward
        behind = p.tethered_behind_distance if tethered else p.behind_distance
        if distance == cap:
            error = sleeve.p_c - (hand - cap * direction)
            error = error - to.front * (to.front @ error)
            wait = p.approach_slope * max(0.0, float(np.linalg.norm(error)) - 2.0 * p.aside_free)
            goal = hand - cap * direction - min(wait, behind) * to.front
        return goal

    def _target(
        self,
        tasks: tuple[Task, Task],
        side: int,
        axes: Sequence[Sequence[ArmAxis]],
        headings: Sequence[Heading],
        facts: Sequence[SleeveFacts],
        sleeves: Sequence[SleeveState],
        retreat: bool,
        ease: bool,
        attempts: tuple[int, int],
    ) -> SleeveTarget:
        p, n = self.parameters, self.parameters.horizon
        task = tasks[side]
        position, direction = np.empty((n, 3)), np.empty((n, 3))
        entering = task in (Task.PREPARE, Task.REST) or not facts[side].linked
        for j in range(n):
            axis, to = axes[side][j + 1], headings[j + 1]
            if entering:
                position[j] = self._prepared(
                    axis,
                    to,
                    sleeves[side],
                    side,
                    facts[1 - side].linked,
                    facts[side].in_sight,
                    retreat,
                    attempts[side],
                )
                direction[j] = _between(_inward(to, side), axis.D(0.0), p.orientation_share)
                continue
            if task == Task.DRESS:
                step = -p.progress_step if ease else p.progress_step
                s = facts[side].s + (j + 1) * step
                other_fact = facts[1 - side]
                if other_fact.linked:
                    s = min(s, max(facts[side].s, other_fact.s + p.largest_lead))
            else:
                k = 1 - side
                other = self._prepared(
                    axes[k][j + 1], to, sleeves[k], k, True, facts[k].in_sight, False, attempts[k]
                )
                s = self._waiting_progress(axis, other)
            s = min(p.final_progress, max(0.0, s))
            position[j], direction[j] = axis.G(s), axis.D(s)
        if task == Task.REST:
            return SleeveTarget(position, direction, 0.0, 0.0)
        if entering:
            return SleeveTarget(position, direction, entering=True)
        return SleeveTarget(position, direction, direction_weight=p.dressing_direction)

    def _waiting_progress(self, axis: ArmAxis, other: FloatArray) -> float:
        """Returns the largest s from which the garment reaches `other` (3,), m (J_w).

        Higher up than that the garment holds the other sleeve back; lower down it could slip off.
        """
        least = self.parameters.stages.waiting_progress
        steps = np.linspace(2.0, least, 41)
        for s in steps:
            if (
                np.linalg.norm(axis.G(float(s)) - other)
                < self.parameters.waiting_reach * self._reach
            ):
                return float(s)
        return least

    def _obstacles(self, joints: FloatArray) -> list[Obstacles]:
        """Returns the predicted person at the start of each step."""
        person, h = self._person, self.parameters.time_step
        torso = [c for c in person.capsules if c.body == "torso"]
        upper, fore, hand = person.radius
        radius = np.array([c.radius for c in torso] + [upper, fore, hand] * 2)
        rows_a, rows_b = [], []
        for q in joints:
            turned = heading(q).rotation
            shift = 0.5 * (q[0] + q[3]) - turned @ person.shoulders.mean(axis=0)
            a = [turned @ c.a_B + shift for c in torso]
            b = [turned @ c.b_B + shift for c in torso]
            for i in (0, 3):
                a += [q[i], q[i + 1], q[i + 2]]
                b += [q[i + 1], q[i + 2], q[i + 2]]
            rows_a.append(np.array(a))
            rows_b.append(np.array(b))
        predicted = []
        for j in range(len(joints) - 1):
            va, vb = (rows_a[j + 1] - rows_a[j]) / h, (rows_b[j + 1] - rows_b[j]) / h
            axis = rows_b[j] - rows_a[j]
            length2 = np.maximum(np.einsum("ij,ij->i", axis, axis), 1e-12)[:, None]
            omega = np.cross(axis, vb - va) / length2
            predicted.append(Obstacles(rows_a[j], rows_b[j], radius, va, omega))
        return predicted


def _inward(to: Heading, side: int) -> FloatArray:
    """Returns the unit vector from a side of the person to the other."""
    return to.leftward * (-1.0 if side == 0 else 1.0)


def _aside(offset: FloatArray, direction: FloatArray) -> float:
    """Returns the length of `offset` across the unit vector `direction`."""
    return float(np.linalg.norm(offset - direction * (direction @ offset)))


def _ramp(value: float, zero: float, one: float) -> float:
    """Returns 0 beyond `zero`, 1 beyond `one`, linear between."""
    return min(1.0, max(0.0, (value - zero) / (one - zero)))


def _between(a: FloatArray, b: FloatArray, share: float) -> FloatArray:
    """Returns the unit vector between unit vectors `a` (share 0) and `b` (share 1)."""
    mixed = (1.0 - share) * a + share * b
    unit: FloatArray = mixed / np.linalg.norm(mixed)
    return unit
