"""From observation to plan: tasks, then targets, then the global controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth, ExplicitSettings
from drake_dress.models.cloth.material import Material
from drake_dress.models.control.budget import Budget, Spending
from drake_dress.models.control.costs import GarmentCost, Weights
from drake_dress.models.control.global_mpc import GlobalController, Plan
from drake_dress.models.control.insertion_search import (
    InsertionParameters,
    InsertionSearch,
    Scene,
    SearchState,
)
from drake_dress.models.control.laying import (
    CollarPosition,
    GrippersAsWorn,
    WornCoat,
    way_back,
)
from drake_dress.models.control.person_model import PersonModel, kept_away, person_obstacles
from drake_dress.models.control.preparing import lifts
from drake_dress.models.control.situation import HeldGarment, Situation, SleeveTarget
from drake_dress.models.control.task_parameters import TaskParameters, unit
from drake_dress.models.control.tasks import Assignment, TaskPlanner
from drake_dress.models.dressing.finish import (
    FinishParameters,
    FinishState,
    Phase,
    advance_finish,
    may_lower,
    sleeves_on,
)
from drake_dress.models.dressing.sleeve import find_entry
from drake_dress.models.dressing.stages import StageState, Task
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.garment.nape import find_nape
from drake_dress.models.human.heading import headings
from drake_dress.models.human.neck import distance_to_nape, nape
from drake_dress.models.immutable import Immutable
from drake_dress.models.sides import SIDES


@dataclass(frozen=True)
class PolicyParameters:
    """Settings of the global controller and its targets.

    Attributes:
        time_step: of the prediction, s. horizon: number of steps N. max_iterations: limit of
            gradient steps per solve.
        inner_iterations: of the garment's linear solve; 1 is the paper's one-step scheme.
        committed_steps: steps of a plan that pass before it can be used.
        max_speed: speed limit of a gripper, m/s.
        weights: weights of the costs.
        tasks: settings of the sleeve targets.
        spread_share: share of the predicted joints' 90 % radii by which the grippers keep further
            away from the person.
        span_share: share of the way between the grasps over the cloth that the grippers may be
            apart. They may also be as far apart as the grasps are at rest.
        plans: whether to plan with the garment model. If not, plans are to rest, and the local
            controller works alone.
        budget: limits of a solve.
        finish: settings of laying the coat and letting it go.
        insertion: settings of the search for motions that put a hand through an armhole.
    """

    time_step: float = 0.2
    horizon: int = 5
    max_iterations: int = 3
    inner_iterations: int = 5
    committed_steps: int = 2
    max_speed: float = 0.12
    weights: Weights = field(default_factory=Weights)
    tasks: TaskParameters = field(default_factory=TaskParameters)
    spread_share: float = 0.5
    span_share: float = 0.95
    plans: bool = True
    budget: Budget = Budget(iterations=3200)
    finish: FinishParameters = FinishParameters()
    insertion: InsertionParameters = InsertionParameters()


@dataclass(frozen=True)
class PolicyState(Immutable):
    """State carried from one decision to the next.

    `lowers` is whether the person has been told to lower the arms.
    """

    stages: StageState
    velocity: FloatArray
    finish: FinishState = FinishState()
    search: SearchState = SearchState()
    lowers: bool = False

    @property
    def shown(self) -> tuple[int, int]:
        """Stages of left and right sleeve, as in the log."""
        return self.finish.stages(self.stages.stage)


@dataclass(frozen=True)
class Decision:
    """A plan with its tasks; `target` (N,2,3) holds the targets of the armhole centres, m.

    `release` tells whether the coat is laid, so that the grippers are to open; `lowers` whether the
    person is to lower the arms.
    """

    plan: Plan
    assignment: Assignment
    target: FloatArray
    release: bool = False
    lowers: bool = False


class DressingPolicy:
    """Decides how both grippers move, from the estimates of garment and person.

    Args:
        mesh: the controller's garment; it may differ from the true one.
        material: the controller's estimate of the fabric.
        person: the controller's model of the person's shape.
        parameters: settings.
        costs: user-defined costs, added to the dressing costs.
        from_front: whether the garment comes from in front of the person.
    """

    def __init__(
        self,
        mesh: GarmentMesh,
        material: Material,
        person: PersonModel,
        parameters: PolicyParameters,
        costs: Sequence[GarmentCost] = (),
        from_front: bool = False,
    ) -> None:
        self.mesh = mesh
        self.parameters = parameters
        self.person = person
        elements = make_elements(mesh.rest_position, mesh.faces)
        cloth = ExplicitBiasCloth(
            elements,
            material,
            parameters.time_step,
            mesh.held,
            settings=ExplicitSettings(tolerance=1e-2, iterations=parameters.inner_iterations),
        )
        self.planner = TaskPlanner(mesh, parameters.tasks, from_front, person.arms)
        collar = find_nape(mesh.rest_position, mesh.faces, mesh.loops)
        # a garment without a neck's edge, or a plan to rest, cannot be laid
        lays = parameters.finish.release and parameters.plans and collar is not None
        self.finish = replace(parameters.finish, release=lays)
        held = [mesh.rest_position[mesh.grasp[side]] for side in SIDES]
        left, right = (x.mean(axis=0) for x in held)
        self._worn = None
        if collar is not None:
            grippers = np.stack([left, right]) - collar.at(mesh.rest_position)
            height = parameters.finish.gripper_height
            self._worn = WornCoat(collar, grippers, material.margin, height)
        # (k,3) positions of the held nodes relative to left and right gripper, m
        self.held_offsets = mesh.held_offsets
        over_cloth = parameters.span_share * self.planner.reach.between_grippers
        span = max(float(np.linalg.norm(left - right)), over_cloth)
        self.controller = GlobalController(
            cloth,
            HeldGarment(
                (len(mesh.grasp["left"]), len(mesh.grasp["right"])),
                self.planner.armholes,
                self.planner.signs,
                span,
                find_entry(mesh),
            ),
            parameters.horizon,
            parameters.weights,
            parameters.max_speed,
            parameters.max_iterations,
            costs=(
                CollarPosition(parameters.weights.collar, collar, parameters.weights.leading),
                GrippersAsWorn(parameters.weights.collar),
                *costs,
            ),
        )
        self.search = self._searching(elements, material)

    def _searching(self, elements: Elements, material: Material) -> InsertionSearch:
        """Returns the search for the motion that puts the first hand in, with its own garment."""
        p = self.parameters
        cloth = ExplicitBiasCloth(
            elements,
            replace(material, stretch_stiffness=p.insertion.stretch_stiffness),
            p.time_step / p.insertion.substeps,
            self.mesh.held,
            settings=ExplicitSettings(tolerance=1e-2, iterations=p.insertion.iterations),
        )
        return InsertionSearch(cloth, self.controller.grip, self.planner, p.max_speed, p.insertion)

    def initial_state(self) -> PolicyState:
        """Returns the state before the first decision: no sleeve is on, and nothing moves."""
        return PolicyState(StageState(), np.zeros((self.parameters.horizon, 2, 3)))

    def decide(
        self,
        state: PolicyState,
        x: FloatArray,
        v: FloatArray,
        joints: FloatArray,
        time: float,
        elapsed_steps: float = 5.0,
        radius: FloatArray | None = None,
        are_open: bool = False,
    ) -> tuple[PolicyState, Decision]:
        """Returns the next state and the decision.

        Args:
            state: state after the preceding decision.
            x: (n,3) nodes of the controller's garment, m.
            v: (n,3) their velocities, m/s.
            joints: (N+1,6,3) predicted shoulder, elbow, hand of left, then right arm, m; row 0
                is now.
            time: current time, s.
            elapsed_steps: prediction steps since the last decision, possibly fractional. The rest
                of its plan is being executed, and is the initial guess of the descent.
            radius: (N+1,6) of the balls about `joints` that hold the person's with probability 0.9,
                m; None: the prediction tells none.
            are_open: whether both grippers have opened.
        """
        p = self.parameters
        stages, assignment = self.planner.assign(state.stages, x, joints[0], time)
        finish = self._advanced(state, stages, assignment, x, joints[0], are_open, time)
        if finish.phase != Phase.DRESSING:
            # the sleeves sink as the coat is laid, which is no reason to draw them again
            stages = state.stages
            assignment = replace(assignment, tasks=(Task.LAY, Task.LAY))
        lowers = may_lower(state.lowers, finish, stages.stalls, assignment.facts, self.finish)
        state = replace(state, stages=stages, finish=finish, lowers=lowers)
        targets = self.planner.targets(assignment, self.planner.sleeves(x), joints, p.time_step)
        target = np.stack([t.position for t in targets], axis=1)
        if finish.phase == Phase.RELEASED:
            back = way_back(
                self.finish,
                self.planner.toward(joints[0]),
                self.controller.grip.centers(x),
                joints[0],
                len(joints) - 1,
                time - finish.since,
                p.time_step,
            )
            plan = self._moving(x, back, "released")
            return state, Decision(plan, assignment, target, lowers=lowers)
        if not p.plans:
            return state, Decision(
                self._moving(x, 0.0 * state.velocity, "no_plan"), assignment, target
            )
        state, plan = self._planned(state, x, v, joints, targets, assignment, elapsed_steps, radius)
        laid = finish.phase == Phase.LAID
        decision = Decision(plan, assignment, target, laid, lowers)
        return replace(state, velocity=plan.velocity), decision

    def _advanced(
        self,
        state: PolicyState,
        stages: StageState,
        assignment: Assignment,
        x: FloatArray,
        joints: FloatArray,
        are_open: bool,
        time: float,
    ) -> FinishState:
        """Returns how far the coat is laid and let go."""
        if self._worn is None:
            return state.finish
        toward, collar = self.planner.toward, self._worn.collar.at(x)
        place = self._worn.collar_target(self.person, joints, toward)
        ends = nape(joints, self.person.shoulder_radius, self.person.neck_radius, toward(joints))
        return advance_finish(
            state.finish,
            sleeves_on(stages.stage, assignment.facts, joints, self.finish),
            assignment.facts,
            float(np.linalg.norm(collar - place)),
            distance_to_nape(collar, ends),
            are_open,
            self.finish,
            time,
        )

    def _planned(
        self,
        state: PolicyState,
        x: FloatArray,
        v: FloatArray,
        joints: FloatArray,
        targets: tuple[SleeveTarget, SleeveTarget],
        assignment: Assignment,
        elapsed_steps: float,
        radius: FloatArray | None,
    ) -> tuple[PolicyState, Plan]:
        """Returns the plan of the global controller; arguments as of `decide`."""
        p, lays = self.parameters, state.finish.phase != Phase.DRESSING
        obstacles = person_obstacles(self.person, joints, p.time_step)
        away = None if radius is None else kept_away(obstacles, radius, p.spread_share)
        laying, max_speed = None, p.max_speed
        if lays and self._worn is not None:
            max_speed = self.finish.max_speed
            laying = self._worn.target(self.person, joints[1:], self.planner.toward)
        elif all(
            fact.linked and fact.s >= p.tasks.stages.creeping_progress for fact in assignment.facts
        ):
            max_speed = p.tasks.settling_speed
        leftward = headings(joints[1:]).leftward
        leading = self._leading(state, assignment, targets, joints)
        situation = Situation(x, v, targets, obstacles, leftward, away, laying, leading)
        guess = later(state.velocity, elapsed_steps)
        state, side = self._entering(state, assignment)
        if side is None:
            plan = self.controller.solve(situation, guess, p.committed_steps, p.budget, max_speed)
            return state, plan
        first, to = p.committed_steps, self.planner.toward(joints[-1])
        person = obstacles if away is None else away
        spending = Spending(Budget(iterations=p.insertion.budget))
        scene = Scene(x, v, joints[-1], obstacles, person[-1], to, side, spending)
        search, velocity = self.search.advance(state.search, scene, guess[:first])
        moves = np.zeros_like(guess)
        moves[:first] = guess[:first]
        rest = velocity[: len(moves) - first]
        moves[first : first + len(rest)] = rest
        return replace(state, search=search), self.controller.follow(situation, moves)

    def _leading(
        self,
        state: PolicyState,
        assignment: Assignment,
        targets: tuple[SleeveTarget, SleeveTarget],
        joints: FloatArray,
    ) -> FloatArray | None:
        """Returns places (N,3), m, of the collar while an armhole is lifted over a hand that hangs.

        The collar is where it would be if the forearm were in the sleeve: further up along the
        forearm, and behind it. Elsewhere the coat's shoulder lies across the forearm, and pushes it
        away from the armhole.
        """
        first, p = state.stages.first, self.parameters.tasks
        if self._worn is None or first < 0 or assignment.withdraw or assignment.retreat[first]:
            return None
        forearm = unit(joints[1:, 3 * first + 1] - joints[1:, 3 * first + 2])
        is_on = any(fact.linked for fact in assignment.facts)
        near = assignment.facts[first].hand_distance < p.leading_distance
        missed = assignment.attempts[first]
        if not near or not lifts(p, forearm[0], is_on, missed, self.mesh.hold):
            return None
        rest = self.mesh.rest_position
        armhole = rest[self.planner.armholes[first]].mean(axis=0)
        above = float(np.linalg.norm(self._worn.collar.at(rest) - armhole))
        behind = p.leading_behind * self.planner.toward(joints[0]).front
        place: FloatArray = targets[first].position + above * forearm - behind
        return place

    def _entering(
        self, state: PolicyState, assignment: Assignment
    ) -> tuple[PolicyState, int | None]:
        """Returns the state, and the side of the hand for which to search; None for no search.

        In real time there is no time to try motions all the way.
        """
        first, misses = state.stages.first, sum(state.stages.attempts)
        in_real_time = self.parameters.budget.seconds is not None
        if first < 0 or in_real_time or any(fact.linked for fact in assignment.facts):
            misses = -1  # too few for a search
        begun, side = self.search.begun(state.search, first, self.planner.are_alike, misses)
        return replace(state, search=begun), side

    def _moving(self, x: FloatArray, velocity: FloatArray, reason: str) -> Plan:
        """Returns a plan of given velocities (N,2,3), m/s, in which the sleeves stay in place."""
        n = self.parameters.horizon
        centers = np.stack([sleeve.p_c for sleeve in self.planner.sleeves(x)])
        return Plan(
            velocity=velocity,
            cost=0.0,
            initial_cost=0.0,
            iterations=0,
            evaluations=0,
            reason=reason,
            armhole=np.tile(centers, (n, 1, 1)),
            force=np.zeros((n, 2)),
        )


def later(velocity: FloatArray, steps: float) -> FloatArray:
    """Returns the velocities (N,…) of a plan shifted by `steps`, averaged within each new step.

    The last velocity is held beyond the end of the plan.
    """
    whole = int(np.floor(steps + 1e-9))
    part, n = max(0.0, steps - whole), len(velocity)
    held = np.concatenate([velocity, np.repeat(velocity[-1:], whole + 1, axis=0)])
    now, following = held[whole : whole + n], held[whole + 1 : whole + 1 + n]
    mean: FloatArray = (1.0 - part) * now + part * following
    return mean
