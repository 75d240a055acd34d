"""The local controller: compensates the global plan by what is seen now (Eq. loc_mpc).

Before each solve the global plan is cut off at the time that has come, and goes on at its end as it
ended. Where it leads is what its own rollout foresaw, from where sleeves and grippers are now; the
paper rolls the garment out anew instead, which at 50 Hz would cost ten times what there is. Tasks
are those of the plan; where they lead follows the person and the sleeves as they are seen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.constrained_ddp import feedback_gains, solve
from drake_dress.models.control.local_model import (
    LocalParameters,
    Nominal,
    SleeveGoal,
    is_coupled,
    local_problem,
)
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.solution import Solution
from drake_dress.models.control.tasks import Assignment, TaskPlanner, arm_axes
from drake_dress.models.dressing.sleeve import SleeveState
from drake_dress.models.dressing.stages import SleeveFacts, Task
from drake_dress.models.garment.geodesics import Reach, reach
from drake_dress.models.immutable import Immutable

Solver = Callable[[LocalProblem, Solution | None], Solution]


@dataclass(frozen=True)
class GlobalPlan(Immutable):
    """A global plan in time.

    Attributes:
        start: of its first step, s. time_step: s.
        velocity: (N,2,3) of left and right gripper, m/s.
        armhole: (N+1,2,3) armhole centres as foreseen, m; row 0 is at `start`.
        assignment: what the sleeves are to do; None before anything is planned.
        joints: (N+1,6,3) where it believed the person's to be, m; None if the plan is to rest, and
            the local controller to go for the targets by itself.
    """

    start: float
    time_step: float
    velocity: FloatArray
    armhole: FloatArray
    assignment: Assignment | None = None
    joints: FloatArray | None = None

    @classmethod
    def resting(cls) -> GlobalPlan:
        """Returns the plan before anything is planned: to rest."""
        return cls(0.0, 1.0, np.zeros((1, 2, 3)), np.zeros((2, 2, 3)))

    def velocity_at(self, time: float) -> FloatArray:
        """Returns the gripper velocities (2,3) at a time, s; zero before the plan and after it."""
        step = int(np.floor((time - self.start + 1e-9) / self.time_step))
        if not 0 <= step < len(self.velocity):
            return np.zeros((2, 3))
        velocity: FloatArray = self.velocity[step]
        return velocity


@dataclass(frozen=True)
class LocalPlan(Immutable):
    """Gripper velocities for the next steps, and how to correct them meanwhile.

    Attributes:
        start: s. time_step: s.
        velocity: (N,2,3) of left and right gripper, m/s.
        state: (N+1,12) where sleeve centres and grippers are foreseen to be, left and right, m.
        gain: (N,6,12) ∂(velocity)/∂(state), 1/s.
        max_speed: of a gripper, m/s.
    """

    start: float
    time_step: float
    velocity: FloatArray
    state: FloatArray
    gain: FloatArray
    max_speed: float

    def velocity_at(self, time: float, state: FloatArray | None = None) -> FloatArray:
        """Returns the gripper velocities (2,3) at a time, m/s; zero where the plan has run out.

        Args:
            time: s.
            state: (12,) where sleeve centres and grippers are, m; as foreseen if None.
        """
        steps = (time - self.start) / self.time_step + 1e-9
        j = int(np.floor(steps))
        if not 0 <= j < len(self.velocity):
            return np.zeros((2, 3))
        velocity = self.velocity[j]
        if state is not None:
            share = steps - j
            foreseen = (1.0 - share) * self.state[j] + share * self.state[j + 1]
            velocity = velocity + (self.gain[j] @ (state - foreseen)).reshape(2, 3)
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        limited: FloatArray = velocity * np.minimum(1.0, self.max_speed / np.maximum(speed, 1e-12))
        return limited


@dataclass(frozen=True)
class LocalState(Immutable):
    """What is carried from one solve to the next: the solution, and whether sleeves are coupled."""

    solution: Solution | None = None
    start: float = 0.0
    coupled: bool = False


@dataclass(frozen=True)
class LocalOutcome:
    """What a solve has led to; `problem` is None while there is nothing to do."""

    state: LocalState
    plan: LocalPlan
    problem: LocalProblem | None


# Where a sleeve shall be (M+1,3), m, and turned to (M+1,3), and the weight of that.
_Place = tuple[FloatArray, FloatArray, float]


@dataclass(frozen=True)
class _Seen:
    """What a solve sees of garment and person.

    Attributes:
        sleeves: of left and right now.
        joints: (M+1,6,3) predicted, m; row 0 is now.
        joints_step: between its rows, s.
        time: now, s.
    """

    sleeves: Sequence[SleeveState]
    joints: FloatArray
    joints_step: float
    time: float


@dataclass(frozen=True)
class LocalController:
    """Solves local problems one after the other.

    Attributes:
        planner: of tasks, with the controller's garment.
        parameters: of the problems.
        solver: takes a problem and the solution that the one before suggests, if any.
        reach: of the controller's garment.
    """

    planner: TaskPlanner
    parameters: LocalParameters
    solver: Solver = field(default_factory=lambda: solve)
    reach: Reach = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "reach", reach(self.planner.mesh))

    def resting(self, time: float) -> LocalPlan:
        """Returns a plan that does nothing."""
        return LocalPlan(
            time,
            self.parameters.time_step,
            np.zeros((0, 2, 3)),
            np.zeros((1, 12)),
            np.zeros((0, 6, 12)),
            self.parameters.max_speed,
        )

    def solve(
        self,
        state: LocalState,
        plan: GlobalPlan,
        x: FloatArray,
        gripper: FloatArray,
        joints: FloatArray,
        joints_step: float,
        time: float,
    ) -> LocalOutcome:
        """Returns the local plan from now on.

        Args:
            state: of the solve before.
            plan: the newest global plan.
            x: (n,3) the controller's garment now, m.
            gripper: (2,3) of left and right now, m.
            joints: (M+1,6,3) predicted, m; row 0 is now.
            joints_step: between its rows, s.
            time: now, s.
        """
        p = self.parameters
        if plan.assignment is None:
            return LocalOutcome(LocalState(), self.resting(time), None)
        seen = _Seen(self.planner.sleeves(x), joints, joints_step, time)
        centers = np.stack([sleeve.p_c for sleeve in seen.sleeves])
        nominal, foreseen = continued(plan, centers, gripper, time, p)
        coupled = is_coupled(
            state.coupled, float(np.linalg.norm(centers[0] - centers[1])), self.reach, p
        )
        assignment = self.planner.renewed(plan.assignment, seen.sleeves, joints[0])
        goals = self._goals(plan, assignment, seen, nominal, foreseen)
        problem = local_problem(nominal, goals, coupled, self.reach, p)
        found = self.solver(problem, _shifted(state, time, p))
        local = _local_plan(nominal, problem, found, time, p)
        return LocalOutcome(LocalState(found, time, coupled), local, problem)

    def _goals(
        self,
        plan: GlobalPlan,
        assignment: Assignment,
        seen: _Seen,
        nominal: Nominal,
        foreseen: FloatArray,
    ) -> tuple[SleeveGoal, SleeveGoal]:
        """Returns the goals of left and right sleeve.

        Args:
            plan: the newest global plan.
            assignment: its tasks, as they are now.
            seen: garment and person.
            nominal: what the plan leads to.
            foreseen: (N+1,2,3) where the plan foresaw the sleeves, m.
        """
        p, step = self.parameters, seen.joints_step
        places = self._places(assignment, seen.sleeves, seen.joints, step)
        believed = self._believed_places(plan, assignment, seen)
        goals = []
        for i, (place, direction, weight) in enumerate(places):
            task = assignment.tasks[i]
            # between the times of the predicted joints targets go straight
            arm = position = _resampled(place, step, p)
            if believed is not None:
                # what the plan leads to, moved as the person moves otherwise than it believed
                position = nominal.sleeve[:, i] + position
                position = position - _resampled(believed[i][0], step, p)
                share = p.dress_correction if task == Task.DRESS else p.prepare_correction
                position = position + share * (foreseen[:, i] - nominal.sleeve[:, i])
            axis = _resampled(direction, step, p)
            axis /= np.linalg.norm(axis, axis=1, keepdims=True)
            on_arm = _is_on_arm(assignment.facts[i], task)
            goals.append(SleeveGoal(position, weight, on_arm, arm, axis))
        return goals[0], goals[1]

    def _believed_places(
        self, plan: GlobalPlan, assignment: Assignment, seen: _Seen
    ) -> list[_Place] | None:
        """Returns the places that follow from the joints the plan believed in; None if in none."""
        if plan.joints is None:
            return None
        count = len(seen.joints)
        soon = seen.time + seen.joints_step * np.arange(count, dtype=np.float64)
        planned = joints_of_plan(plan, soon)
        planned = _own_motion(planned, seen.joints, assignment, self.parameters.dragged)
        return self._places(assignment, seen.sleeves, planned, seen.joints_step)

    def _places(
        self,
        assignment: Assignment,
        sleeves: Sequence[SleeveState],
        joints: FloatArray,
        joints_step: float,
    ) -> list[_Place]:
        """Returns for each sleeve (M+1,3) where it shall be, m, and turned to; and the weight.

        A sleeve on its arm begins where it is, one that is not at its first target.
        """
        targets = self.planner.targets(assignment, sleeves, joints, joints_step)
        places = []
        for axis, fact, task, t in zip(
            arm_axes(joints[0]), assignment.facts, assignment.tasks, targets, strict=True
        ):
            first = axis.G(fact.s) if _is_on_arm(fact, task) else t.position[0]
            position = np.vstack([first, t.position])
            direction = np.vstack([t.direction[:1], t.direction])
            places.append((position, direction, t.position_weight))
        return places


def continued(
    plan: GlobalPlan,
    sleeve: FloatArray,
    gripper: FloatArray,
    time: float,
    parameters: LocalParameters,
) -> tuple[Nominal, FloatArray]:
    """Returns a global plan from a time on, at the local steps; where it ends it goes on as it was.

    Args:
        plan: with its own steps.
        sleeve: (2,3) armhole centres now, m.
        gripper: (2,3) now, m.
        time: now, s.
        parameters: horizon and time step.

    Returns:
        Where it leads from here, and where it foresaw the sleeves (N+1,2,3), m.
    """
    n, h = parameters.horizon, parameters.time_step
    now = (time - plan.start) / plan.time_step
    middle = now + (np.arange(n) + 0.5) * h / plan.time_step
    step = np.clip(np.floor(middle + 1e-9).astype(int), 0, len(plan.velocity) - 1)
    velocity = plan.velocity[step]
    at = time + h * np.arange(n + 1, dtype=np.float64)
    # beyond the end sleeves go on with their grippers
    end = plan.start + len(plan.velocity) * plan.time_step
    beyond = np.maximum(at - end, 0.0)[:, None, None] * plan.velocity[-1]
    foreseen = _of_plan(plan, plan.armhole, at) + beyond
    moved = np.concatenate([np.zeros((1, 2, 3)), h * np.cumsum(velocity, axis=0)])
    planned = plan.joints is not None
    return Nominal(sleeve + foreseen - foreseen[0], gripper + moved, velocity, planned), foreseen


def joints_of_plan(plan: GlobalPlan, times: FloatArray) -> FloatArray:
    """Returns (M,6,3) where a plan believed the joints to be at M times, s, m."""
    if plan.joints is None:
        raise ValueError("this plan is to rest and believes nothing of joints")
    return _of_plan(plan, plan.joints, times)


def _of_plan(plan: GlobalPlan, rows: FloatArray, times: FloatArray) -> FloatArray:
    """Returns rows (N+1,…) of a plan at M times, s; before its start and after its end as there."""
    at = np.clip((times - plan.start) / plan.time_step, 0.0, len(rows) - 1.0)
    row = np.minimum(np.floor(at + 1e-9).astype(int), len(rows) - 2)
    share = (at - row).reshape(-1, *[1] * (rows.ndim - 1))
    found: FloatArray = (1.0 - share) * rows[row] + share * rows[row + 1]
    return found


def _is_on_arm(fact: SleeveFacts, task: Task) -> bool:
    """Returns whether a sleeve is on its arm, and to be moved along it or kept there."""
    return fact.linked and task in (Task.DRESS, Task.WAIT)


def _local_plan(
    nominal: Nominal, problem: LocalProblem, found: Solution, time: float, p: LocalParameters
) -> LocalPlan:
    """Returns the plan of a solution, which begins at `time`, s."""
    base = np.concatenate([nominal.sleeve, nominal.gripper], axis=1).reshape(-1, 12)
    return LocalPlan(
        time,
        p.time_step,
        nominal.velocity + found.v.reshape(-1, 2, 3),
        base + found.x,
        _bounded(feedback_gains(problem, found), 1.0 / p.time_step),
        p.max_speed,
    )


def _own_motion(
    planned: FloatArray, joints: FloatArray, assignment: Assignment, dragged: float
) -> FloatArray:
    """Returns joints (M+1,6,3) as a plan believed them, less what is not the person's own motion.

    An arm in a sleeve goes where the sleeve takes it, and a hand is pushed along by the cloth on
    it. Who follows that follows himself, and the garment creeps away with the arms in it.

    Args:
        planned: (M+1,6,3) as believed, m.
        joints: (M+1,6,3) as predicted now, m.
        assignment: whose arm is in its sleeve.
        dragged: how far a hand is taken to be pushed, m.
    """
    off = joints - planned
    for i, fact in enumerate(assignment.facts):
        arm = slice(3 * i, 3 * i + 3)
        body = off[:, 3 * i : 3 * i + 1]
        own = off[:, arm] - body
        far = np.linalg.norm(own[:, 2], axis=1)[:, None, None]
        share = 0.0 if fact.linked else np.maximum(0.0, 1.0 - dragged / np.maximum(far, 1e-12))
        off[:, arm] = body + share * own
    believed: FloatArray = joints - off
    return believed


def _bounded(gain: FloatArray, most: float) -> FloatArray:
    """Returns gains (N,6,12), those of a step scaled to a spectral norm of at most `most`, 1/s.

    To be back in a step is the most that can be asked. Bounds that only just leave room ask for
    any gain at all, as the smallest change moves what is active far along them.
    """
    size = np.linalg.norm(gain, axis=(1, 2))  # no less than the spectral norm, and cheap
    if (size <= most).all():
        return gain
    known = np.where(np.isfinite(size)[:, None, None], gain, 0.0)
    spectral = np.linalg.norm(known, ord=2, axis=(1, 2))
    bounded: FloatArray = known * (most / np.maximum(spectral, most))[:, None, None]
    return bounded


def _resampled(rows: FloatArray, step: float, p: LocalParameters) -> FloatArray:
    """Returns rows (M+1,3), a `step`, s, apart, at the N+1 local times; the last one stays."""
    at = np.minimum(np.arange(p.horizon + 1) * p.time_step / step, len(rows) - 1)
    low = np.minimum(at.astype(int), len(rows) - 2)
    share = (at - low)[:, None]
    between: FloatArray = (1.0 - share) * rows[low] + share * rows[low + 1]
    return between


def _shifted(state: LocalState, time: float, p: LocalParameters) -> Solution | None:
    """Returns the solution before as it goes on from now; None if it is too old or none at all."""
    if state.solution is None or not state.solution.converged:
        return None
    steps = int(np.floor((time - state.start) / p.time_step + 0.5))
    if not 0 <= steps < p.horizon:
        return None
    if steps == 0:
        return state.solution
    s = state.solution

    def moved(rows: FloatArray) -> FloatArray:
        return np.concatenate([rows[steps:], np.repeat(rows[-1:], steps, axis=0)])

    return Solution(
        moved(s.v),
        moved(s.x),
        moved(s.state_multiplier),
        moved(s.input_multiplier),
        s.cost,
        s.violation,
        s.sweeps,
        s.interior_steps,
        s.converged,
    )
