"""The local controller: compensates the global plan by what is seen now (Eq. loc_mpc).

Before each solve the global plan is cut off at the time that has come, and goes on at its end as it
ended. Where it leads is what its own rollout foresaw, from where sleeves and grippers are now; the
paper rolls the garment out anew instead, which at 50 Hz would cost ten times what there is. Tasks
are those of the plan; where they lead follows the person and the sleeves as they are seen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.cloth.elements import FloatArray
from drake_dress.models.control.constrained_ddp import feedback_gains, solve_constrained_ddp
from drake_dress.models.control.local_model import (
    LocalParameters,
    Nominal,
    SleeveGoal,
    is_coupled,
    local_problem,
)
from drake_dress.models.control.local_problem import LocalProblem, LocalSolution
from drake_dress.models.control.tasks import Assignment, TaskPlanner, arm_axes
from drake_dress.models.dressing.stages import Task
from drake_dress.models.garment.geodesics import Reach, reach

Solver = Callable[[LocalProblem, LocalSolution | None], LocalSolution]


@dataclass(frozen=True)
class GlobalPlan:
    """A global plan in time.

    Attributes:
        start: of its first step, s. time_step: s.
        velocity: (N,2,3) of left and right gripper, m/s.
        armhole: (N+1,2,3) armhole centres as foreseen, m; row 0 is at `start`.
        assignment: what the sleeves are to do; None before anything is planned.
        target: (N+1,2,3) where the sleeves were asked to be when it was planned, m; None if the
            plan is to rest, and the local controller to go for the targets by itself.
    """

    start: float
    time_step: float
    velocity: FloatArray
    armhole: FloatArray
    assignment: Assignment | None = None
    target: FloatArray | None = None


@dataclass(frozen=True)
class LocalPlan:
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
class LocalState:
    """What is carried from one solve to the next: the solution, and whether sleeves are coupled."""

    solution: LocalSolution | None = None
    start: float = 0.0
    coupled: bool = False


@dataclass(frozen=True)
class LocalOutcome:
    """What a solve has led to; `problem` is None while there is nothing to do."""

    state: LocalState
    plan: LocalPlan
    problem: LocalProblem | None


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
    solver: Solver = field(default_factory=lambda: constrained_ddp)
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
        sleeves = self.planner.sleeves(x)
        centers = np.stack([sleeve.p_c for sleeve in sleeves])
        nominal, foreseen, planned = continued(plan, centers, gripper, time, p)
        coupled = is_coupled(
            state.coupled, float(np.linalg.norm(centers[0] - centers[1])), self.reach, p
        )
        assignment = self.planner.renewed(plan.assignment, sleeves, joints[0])
        targets = self.planner.targets(assignment, sleeves, joints, joints_step)
        goals = []
        axes = arm_axes(joints[0])
        for i, target in enumerate(targets):
            fact, task = assignment.facts[i], assignment.tasks[i]
            on_arm = fact.linked and task in (Task.DRESS, Task.WAIT)
            # between the times of the predicted joints targets go straight
            first = axes[i].G(fact.s) if on_arm else target.position[0]
            position = _resampled(np.vstack([first, target.position]), joints_step, p)
            arm = position
            if planned is not None:
                # where the plan saw the sleeve, moved as its target has moved since
                position = foreseen[:, i] + position - planned[:, i]
            axis = _resampled(np.vstack([target.direction[:1], target.direction]), joints_step, p)
            axis /= np.linalg.norm(axis, axis=1, keepdims=True)
            goals.append(SleeveGoal(position, target.position_weight, on_arm, arm, axis))
        problem = local_problem(nominal, (goals[0], goals[1]), coupled, self.reach, p)
        found = self.solver(problem, _shifted(state, time, p))
        velocity = nominal.velocity + found.v.reshape(-1, 2, 3)
        base = np.concatenate([nominal.sleeve, nominal.gripper], axis=1).reshape(-1, 12)
        local = LocalPlan(
            time,
            p.time_step,
            velocity,
            base + found.x,
            _bounded(feedback_gains(problem, found), 1.0 / p.time_step),
            p.max_speed,
        )
        return LocalOutcome(LocalState(found, time, coupled), local, problem)


def continued(
    plan: GlobalPlan,
    sleeve: FloatArray,
    gripper: FloatArray,
    time: float,
    parameters: LocalParameters,
) -> tuple[Nominal, FloatArray, FloatArray | None]:
    """Returns a global plan from a time on, at the local steps; where it ends it goes on as it was.

    Args:
        plan: with its own steps.
        sleeve: (2,3) armhole centres now, m.
        gripper: (2,3) now, m.
        time: now, s.
        parameters: horizon and time step.

    Returns:
        Where it leads from here, where it foresaw the sleeves (N+1,2,3), m, and where they were
        asked to be then, (N+1,2,3) or None.
    """
    n, h = parameters.horizon, parameters.time_step
    now = (time - plan.start) / plan.time_step
    middle = now + (np.arange(n) + 0.5) * h / plan.time_step
    step = np.clip(np.floor(middle + 1e-9).astype(int), 0, len(plan.velocity) - 1)
    velocity = plan.velocity[step]
    at = now + np.arange(n + 1) * h / plan.time_step
    last = float(len(plan.velocity))
    inside = np.clip(at, 0.0, last)
    row = np.minimum(np.floor(inside).astype(int), len(plan.velocity) - 1)
    share = (inside - row)[:, None, None]
    # beyond the end sleeves go on with their grippers
    beyond = (np.maximum(at - last, 0.0) * plan.time_step)[:, None, None] * plan.velocity[-1]

    def between(rows: FloatArray) -> FloatArray:
        found: FloatArray = (1.0 - share) * rows[row] + share * rows[row + 1]
        return found

    foreseen = between(plan.armhole) + beyond
    moved = np.concatenate([np.zeros((1, 2, 3)), h * np.cumsum(velocity, axis=0)])
    nominal = Nominal(sleeve + foreseen - foreseen[0], gripper + moved, velocity)
    return nominal, foreseen, None if plan.target is None else between(plan.target)


def constrained_ddp(problem: LocalProblem, before: LocalSolution | None) -> LocalSolution:
    """Solves by constrained DDP, from the solution before if there is one."""
    if before is None:
        return solve_constrained_ddp(problem)
    return solve_constrained_ddp(
        problem, before.v, before.state_multiplier, before.input_multiplier
    )


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


def _shifted(state: LocalState, time: float, p: LocalParameters) -> LocalSolution | None:
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

    return LocalSolution(
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
