"""The local controller: corrects the global plan by the current observation (Eq. loc_mpc).

Before each solve the global plan is truncated at the current time and extended with its last
velocity. The nominal motion is that of the plan's own rollout, moved to the observed sleeves and
grippers. The paper rolls the garment out again instead, which at 50 Hz would take ten times the
available time. Tasks are those of the plan; their targets follow the observed person and sleeves.
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
from drake_dress.models.garment.geodesics import Reach
from drake_dress.models.immutable import Immutable

Solver = Callable[[LocalProblem, Solution | None], Solution]


@dataclass(frozen=True)
class GlobalPlan(Immutable):
    """A global plan with its times.

    Attributes:
        start: start of its first step, s. time_step: s.
        velocity: (N,2,3) of left and right gripper, m/s.
        armhole: (N+1,2,3) predicted armhole centres, m; row 0 is at `start`.
        assignment: tasks of the sleeves; None before the first plan.
        joints: (N+1,6,3) the person's joints that the plan assumed, m; None if the plan is to rest
            and the local controller tracks the targets by itself.
        release: whether the coat is laid, so that the grippers are to open.
        is_released: whether they have opened, so that nothing ties them to the garment.
        lowers: whether the person is to lower the arms.
    """

    start: float
    time_step: float
    velocity: FloatArray
    armhole: FloatArray
    assignment: Assignment | None = None
    joints: FloatArray | None = None
    release: bool = False
    is_released: bool = False
    lowers: bool = False

    @classmethod
    def resting(cls) -> GlobalPlan:
        """Returns the plan that applies before the first one: to rest."""
        return cls(0.0, 1.0, np.zeros((1, 2, 3)), np.zeros((2, 2, 3)))

    def velocity_at(self, time: float) -> FloatArray:
        """Returns the gripper velocities (2,3), m/s, at a time, s; zero outside the plan."""
        step = int(np.floor((time - self.start + 1e-9) / self.time_step))
        if not 0 <= step < len(self.velocity):
            return np.zeros((2, 3))
        velocity: FloatArray = self.velocity[step]
        return velocity


@dataclass(frozen=True)
class LocalPlan(Immutable):
    """Gripper velocities for the next steps, with feedback gains for use between solves.

    Attributes:
        start: start of the first step, s. time_step: s.
        velocity: (N,2,3) of left and right gripper, m/s.
        state: (N+1,12) predicted sleeve centres and grippers, left and right, m.
        gain: (N,6,12) ∂(velocity)/∂(state), 1/s.
        max_speed: speed limit of a gripper, m/s.
    """

    start: float
    time_step: float
    velocity: FloatArray
    state: FloatArray
    gain: FloatArray
    max_speed: float

    def velocity_at(self, time: float, state: FloatArray | None = None) -> FloatArray:
        """Returns the gripper velocities (2,3) at a time, m/s; zero outside the plan.

        Args:
            time: s.
            state: (12,) observed sleeve centres and grippers, m; as predicted if None.
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
    """State carried from one solve to the next: solution, its start, s, and sleeve coupling."""

    solution: Solution | None = None
    start: float = 0.0
    coupled: bool = False


@dataclass(frozen=True)
class LocalOutcome:
    """Result of a solve; `problem` is None before the first global plan."""

    state: LocalState
    plan: LocalPlan
    problem: LocalProblem | None


# Target position (M+1,3), m, and direction (M+1,3) of a sleeve, and the weight of the position.
_Place = tuple[FloatArray, FloatArray, float]


@dataclass(frozen=True)
class _Seen:
    """Observation of garment and person for one solve.

    Attributes:
        sleeves: states of left and right sleeve now.
        joints: (M+1,6,3) predicted, m; row 0 is now.
        joints_step: time between its rows, s.
        time: current time, s.
    """

    sleeves: Sequence[SleeveState]
    joints: FloatArray
    joints_step: float
    time: float


@dataclass(frozen=True)
class LocalController:
    """Solves a sequence of local problems.

    Attributes:
        planner: task planner, with the controller's garment.
        parameters: settings of the problems.
        solver: takes a problem and a warm start, if any.
    """

    planner: TaskPlanner
    parameters: LocalParameters
    solver: Solver = field(default_factory=lambda: solve)

    @property
    def reach(self) -> Reach:
        """Largest distances between armholes and grippers of the controller's garment."""
        return self.planner.reach

    def resting(self, time: float) -> LocalPlan:
        """Returns a plan without motion."""
        return LocalPlan(
            time,
            self.parameters.time_step,
            np.zeros((0, 2, 3)),
            np.zeros((1, 12)),
            np.zeros((0, 6, 12)),
            self.parameters.max_speed,
        )

    def _following(
        self, plan: GlobalPlan, x: FloatArray, gripper: FloatArray, time: float
    ) -> LocalPlan:
        """Returns the plan's own motion of the grippers; arguments as of `solve`."""
        centers = np.stack([sleeve.p_c for sleeve in self.planner.sleeves(x)])
        nominal, _ = continued(plan, centers, gripper, time, self.parameters)
        n = self.parameters.horizon
        return LocalPlan(
            time,
            self.parameters.time_step,
            nominal.velocity,
            np.concatenate([nominal.sleeve, nominal.gripper], axis=1).reshape(-1, 12),
            np.zeros((n, 6, 12)),
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
        """Returns the local plan from `time` on, with the state for the next solve.

        Args:
            state: state after the preceding solve.
            plan: the newest global plan.
            x: (n,3) nodes of the controller's garment now, m.
            gripper: (2,3) positions of left and right gripper now, m.
            joints: (M+1,6,3) predicted, m; row 0 is now.
            joints_step: time between its rows, s.
            time: current time, s.
        """
        p = self.parameters
        if plan.assignment is None:
            return LocalOutcome(LocalState(), self.resting(time), None)
        if plan.is_released:
            return LocalOutcome(LocalState(), self._following(plan, x, gripper, time), None)
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
            assignment: its tasks, with the current progress.
            seen: observation of garment and person.
            nominal: nominal motion of the plan.
            foreseen: (N+1,2,3) sleeves as the plan predicted them, m.
        """
        p, step = self.parameters, seen.joints_step
        places = self._places(assignment, seen.sleeves, seen.joints, step)
        believed = self._believed_places(plan, assignment, seen)
        goals = []
        for i, (place, direction, weight) in enumerate(places):
            task = assignment.tasks[i]
            # targets are interpolated linearly between the times of the predicted joints
            arm = position = _resampled(place, step, p)
            if believed is not None:
                # nominal motion, shifted by the person's deviation from the plan's assumption
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
        """Returns the places for the joints that the plan assumed; None if it assumed none."""
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
        """Returns target position (M+1,3), m, direction (M+1,3), and weight of each sleeve.

        Row 0 of a sleeve on its arm is the axis point at its progress, otherwise its first target.
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
    """Returns a global plan from a time on, at the local steps, extended with its last velocity.

    Args:
        plan: global plan, with its own time steps.
        sleeve: (2,3) armhole centres now, m.
        gripper: (2,3) grippers now, m.
        time: current time, s.
        parameters: horizon and time step.

    Returns:
        The nominal motion from the current state, and the sleeves that the plan predicted
        (N+1,2,3), m.
    """
    n, h = parameters.horizon, parameters.time_step
    now = (time - plan.start) / plan.time_step
    middle = now + (np.arange(n) + 0.5) * h / plan.time_step
    step = np.clip(np.floor(middle + 1e-9).astype(int), 0, len(plan.velocity) - 1)
    velocity = plan.velocity[step]
    at = time + h * np.arange(n + 1, dtype=np.float64)
    # beyond the end sleeves move with their grippers
    end = plan.start + len(plan.velocity) * plan.time_step
    beyond = np.maximum(at - end, 0.0)[:, None, None] * plan.velocity[-1]
    foreseen = _of_plan(plan, plan.armhole, at) + beyond
    moved = np.concatenate([np.zeros((1, 2, 3)), h * np.cumsum(velocity, axis=0)])
    planned = plan.joints is not None
    return Nominal(sleeve + foreseen - foreseen[0], gripper + moved, velocity, planned), foreseen


def joints_of_plan(plan: GlobalPlan, times: FloatArray) -> FloatArray:
    """Returns the joints (M,6,3), m, that a plan assumed at M times, s."""
    if plan.joints is None:
        raise ValueError("this plan is to rest and believes nothing of joints")
    return _of_plan(plan, plan.joints, times)


def _of_plan(plan: GlobalPlan, rows: FloatArray, times: FloatArray) -> FloatArray:
    """Returns rows (N+1,…) of a plan interpolated at M times, s, and constant outside the plan."""
    at = np.clip((times - plan.start) / plan.time_step, 0.0, len(rows) - 1.0)
    row = np.minimum(np.floor(at + 1e-9).astype(int), len(rows) - 2)
    share = (at - row).reshape(-1, *[1] * (rows.ndim - 1))
    found: FloatArray = (1.0 - share) * rows[row] + share * rows[row + 1]
    return found


def _is_on_arm(fact: SleeveFacts, task: Task) -> bool:
    """Returns whether a sleeve is on its arm, and is to be drawn along it or to wait there."""
    return fact.linked and task in (Task.DRESS, Task.WAIT)


def _local_plan(
    nominal: Nominal, problem: LocalProblem, found: Solution, time: float, p: LocalParameters
) -> LocalPlan:
    """Returns the plan of a solution that begins at `time`, s."""
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
    """Returns joints (M+1,6,3) as a plan assumed them, plus motion that the garment has caused.

    Only the rest of the difference to `joints` is the person's own motion. An arm in a sleeve moves
    with the sleeve, and cloth on a hand pushes the hand along. Compensating for motion that the
    garment itself causes creates a feedback loop: the garment creeps away with the arms in it.

    Args:
        planned: (M+1,6,3) as the plan assumed them, m.
        joints: (M+1,6,3) as predicted now, m.
        assignment: its facts tell which arm is in its sleeve.
        dragged: displacement of a hand that is attributed to the cloth, m.
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
    """Returns gains (N,6,12), each step's scaled to a spectral norm of at most `most`, 1/s.

    An error cannot be removed faster than within one step. Bounds that barely leave a feasible set
    can demand arbitrarily large gains, because a small change moves the active set far along them.
    """
    size = np.linalg.norm(gain, axis=(1, 2))  # Frobenius norm: a cheap bound of the spectral norm
    if (size <= most).all():
        return gain
    known = np.where(np.isfinite(size)[:, None, None], gain, 0.0)
    spectral = np.linalg.norm(known, ord=2, axis=(1, 2))
    bounded: FloatArray = known * (most / np.maximum(spectral, most))[:, None, None]
    return bounded


def _resampled(rows: FloatArray, step: float, p: LocalParameters) -> FloatArray:
    """Returns rows (M+1,3), a `step`, s, apart, at the N+1 local times; the last row is held."""
    at = np.minimum(np.arange(p.horizon + 1) * p.time_step / step, len(rows) - 1)
    low = np.minimum(at.astype(int), len(rows) - 2)
    share = (at - low)[:, None]
    between: FloatArray = (1.0 - share) * rows[low] + share * rows[low + 1]
    return between


def _shifted(state: LocalState, time: float, p: LocalParameters) -> Solution | None:
    """Returns the preceding solution shifted to `time`; None if missing, unconverged or too old."""
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
