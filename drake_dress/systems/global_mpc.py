"""The global controller as a Drake system."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_dress.models.control.local_control import GlobalPlan
from drake_dress.models.control.policy import Decision, DressingPolicy, PolicyState
from drake_dress.models.dressing.stages import Stage
from drake_dress.models.immutable import Immutable
from drake_dress.systems.worker_process import WorkerProcess

# Between looks for a plan where the world does not wait, s.
_LOOKING_PERIOD = 0.01
# Between looks whether to give up a rehearsal, s.
_REHEARSAL_STEP = 0.05


@dataclass(frozen=True)
class _Finished:
    decision: Decision
    state: PolicyState
    joints: np.ndarray
    solve_time: float


@dataclass(frozen=True)
class _Progress(Immutable):
    """The solve under way in a context, if there is one.

    A copy of the context awaits the same result: what a solve gives depends on what it was begun
    with alone, and a Future can be read more than once.

    Attributes:
        pending: the result, None while no solve is under way.
        begun_at: when the last solve was begun, s.
        failure: why there are no more solves.
    """

    pending: Future[_Finished] | None = None
    begun_at: float = 0.0
    failure: str | None = None


@dataclass(frozen=True)
class _Solve:
    """One solve, anywhere."""

    policy: DressingPolicy

    def __call__(
        self,
        memory: PolicyState,
        x: np.ndarray,
        v: np.ndarray,
        joints: np.ndarray,
        now: float,
        steps: float,
    ) -> _Finished:
        begin = clock.perf_counter()
        state, decision = self.policy.decide(memory, x, v, joints, now, steps)
        return _Finished(decision, state, joints, clock.perf_counter() - begin)


def _submitted(pool: ThreadPoolExecutor, work: _Solve, *arguments: Any) -> Future[_Finished]:
    return pool.submit(work, *arguments)


class GlobalMpc(LeafSystem):
    """Solves for a plan at a fixed rate and hands it out after a modelled delay.

    .. pydrake_system::

        name: GlobalMpc
        input_ports:
        - garment_position
        - garment_velocity
        - predicted_joint_position
        output_ports:
        - plan
        - stage
        - target
        - solve_time
        - age

    garment_*: (3m,) of the controller's garment, m, m/s. plan: GlobalPlan. stage: (2,) 0 prepare,
    1 dress, 2 done. target: (6,) where left and right armhole shall be next, m. solve_time: (2,)
    wall time of the last solve that ended, s, and the count of solves ended. age: (1,) since what
    the plan in use answers was seen, s.

    A solve starts from what is seen at k·period, and its plan is used from k·period + delay on,
    however long it really took: the run is the same on any machine. It runs on a background thread,
    or with `in_worker` in a worker process, which the rest of the diagram slows down less.

    Where the world does not wait, `waits` is False. Solves then run in a worker process, one at a
    time, and a plan is used from k·period + delay on, or as soon as it is there if that is later.
    The prediction includes what the last plan does until then. If no new plan has come a period
    after the end of the last one, the grippers rest. A solve that fails, or takes longer than
    `patience`, ends planning.

    Args:
        policy: does the work.
        period: time between solves, s.
        delay: time from an observation to the use of its plan, s; less than the period and as long
            as the policy's committed steps.
        waits: whether the world waits for a solve that takes longer than its delay.
        patience: longest time of a solve where the world does not wait, s.
        in_worker: whether solves run in a worker process where the world waits, too.

    All that a run changes stands in its context: several simulators of one diagram give what each
    gives alone. They share the thread or process that solves, one solve after another; where the
    world does not wait, a failure of one ends the solve under way of another, too.
    """

    def __init__(
        self,
        policy: DressingPolicy,
        period: float,
        delay: float,
        waits: bool = True,
        patience: float = 10.0,
        in_worker: bool = False,
    ) -> None:
        super().__init__()
        _check_delay(policy, period, delay)
        self._policy = policy
        self._delay = delay
        self._period = period
        self._patience = patience
        self._waits = waits
        solve = _Solve(policy)
        self._worker = WorkerProcess(solve) if in_worker or not waits else None
        if self._worker is None:
            threads = ThreadPoolExecutor(max_workers=1, thread_name_prefix="global-mpc")
            self._submit: Callable[..., Future[_Finished]] = partial(_submitted, threads, solve)
        else:
            self._submit = self._worker.submit
        m, n = len(policy.mesh.rest_position), policy.parameters.horizon
        self._node_count = m
        self._idle = GlobalPlan(
            0.0, policy.parameters.time_step, np.zeros((n, 2, 3)), np.zeros((n + 1, 2, 3))
        )
        self._plan = self.DeclareAbstractState(Value(self._idle))
        self._memory = self.DeclareAbstractState(Value(policy.initial_state()))
        self._progress = self.DeclareAbstractState(Value(_Progress()))
        # what `_show` shows, and the time of the observation that the plan in use is based on
        self._shown = self.DeclareDiscreteState(np.zeros(11))
        self.DeclareVectorInputPort("garment_position", 3 * m)
        self.DeclareVectorInputPort("garment_velocity", 3 * m)
        self.DeclareVectorInputPort("predicted_joint_position", 18 * (n + 1))
        self._declare_outputs()
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._begin)
        if waits:
            self.DeclarePeriodicUnrestrictedUpdateEvent(period, delay, self._finish)
        else:
            self.DeclarePeriodicUnrestrictedUpdateEvent(_LOOKING_PERIOD, 0.0, self._look)

    def _declare_outputs(self) -> None:
        """Declares the output ports; all but the age depend on state only."""
        self.DeclareAbstractOutputPort(
            "plan",
            lambda: Value(self._idle),
            lambda context, output: output.set_value(
                context.get_abstract_state(self._plan).get_value()
            ),
            {self.abstract_state_ticket(self._plan)},
        )
        shown = {self.discrete_state_ticket(self._shown)}
        for name, rows in (
            ("stage", slice(0, 2)),
            ("target", slice(2, 8)),
            ("solve_time", slice(8, 10)),
        ):
            self.DeclareVectorOutputPort(name, rows.stop - rows.start, self._show(rows), shown)
        self.DeclareVectorOutputPort("age", 1, self._calc_age)

    def rehearse(
        self, x: np.ndarray, joints: np.ndarray, stopped: Callable[[], bool]
    ) -> GlobalPlan | None:
        """Returns a plan of where a run begins, of which the run does not know.

        The first solve anywhere may take a minute, in which its kernels are compiled.

        Args:
            x: (m,3) of the controller's garment, m.
            joints: (6,3) where they stay, m.
            stopped: whether to give up; None is returned then.
        """
        p = self._policy.parameters
        solving = self._submit(
            self._policy.initial_state(),
            x,
            np.zeros_like(x),
            np.tile(joints, (p.horizon + 1, 1, 1)),
            0.0,
            self._period / p.time_step,
        )
        while not wait([solving], _REHEARSAL_STEP).done:
            if stopped():
                return None
        return self._plan_of(solving.result(), 0.0)

    def _plan_of(self, finished: _Finished, start: float) -> GlobalPlan:
        """Returns the plan from the end of its committed steps on, which is at `start`."""
        decision, p = finished.decision, self._policy.parameters
        first = p.committed_steps
        return GlobalPlan(
            start,
            p.time_step,
            decision.plan.velocity[first:],
            decision.plan.armhole[first - 1 :],
            decision.assignment,
            finished.joints[first:] if p.plans else None,
        )

    def failure(self, context: Context) -> str | None:
        """Returns why there are no plans any more, in its own context; None while there are."""
        return self._progress_in(context).failure

    def is_finished(self, context: Context) -> bool:
        """Returns whether both sleeves are done, and still on as they are seen now, in its context.

        Stages are those of the plan in use, which is of a second ago: a sleeve may have slipped.
        """
        if np.any(context.get_discrete_state(self._shown).value()[:2] < Stage.DONE):
            return False
        x = self.get_input_port(0).Eval(context).reshape(-1, 3)
        joints = self.get_input_port(2).Eval(context).reshape(-1, 6, 3)
        return self._policy.planner.are_on(x, joints[0])

    def _progress_in(self, context: Context) -> _Progress:
        progress: _Progress = context.get_abstract_state(self._progress).get_value()
        return progress

    def _begin(self, context: Context, state: State) -> None:
        progress = self._progress_in(context)
        if progress.pending is not None or progress.failure is not None:
            return
        now = context.get_time()
        x = self.get_input_port(0).Eval(context).reshape(-1, 3).copy()
        v = self.get_input_port(1).Eval(context).reshape(-1, 3).copy()
        joints = self.get_input_port(2).Eval(context).reshape(-1, 6, 3).copy()
        memory = context.get_abstract_state(self._memory).get_value()
        # periods that were missed are gone, too
        periods = max(1, round((now - progress.begun_at) / self._period))
        steps = periods * self._period / self._policy.parameters.time_step
        pending = self._submit(memory, x, v, joints, now, steps)
        self._set_progress(state, _Progress(pending, now))

    def _set_progress(self, state: State, progress: _Progress) -> None:
        state.get_mutable_abstract_state(self._progress).set_value(progress)

    def _look(self, context: Context, state: State) -> None:
        progress = self._progress_in(context)
        if progress.pending is None:
            return
        since = context.get_time() - progress.begun_at
        if progress.pending.done():
            error = progress.pending.exception()
            if error is not None:
                self._fail(f"{type(error).__name__}: {error}", progress, state)
            elif since >= self._delay - 1e-9:
                self._finish(context, state)
        elif since > self._patience:
            self._fail(f"no plan for {self._patience:g} s", progress, state)
        else:
            plan: GlobalPlan = context.get_abstract_state(self._plan).get_value()
            end = plan.start + len(plan.velocity) * plan.time_step
            if plan.assignment is not None and context.get_time() > end + self._period:
                state.get_mutable_abstract_state(self._plan).set_value(self._idle)

    def _fail(self, why: str, progress: _Progress, state: State) -> None:
        self._set_progress(state, _Progress(None, progress.begun_at, f"global controller: {why}"))
        state.get_mutable_abstract_state(self._plan).set_value(self._idle)
        if self._worker is not None:
            # nobody waits for it, the end of this process included
            self._worker.kill()

    def _finish(self, context: Context, state: State) -> None:
        progress = self._progress_in(context)
        if progress.pending is None:
            return
        finished = progress.pending.result()
        self._set_progress(state, _Progress(None, progress.begun_at))
        now = context.get_time()
        plan = self._plan_of(finished, now if self._waits else progress.begun_at + self._delay)
        state.get_mutable_abstract_state(self._plan).set_value(plan)
        state.get_mutable_abstract_state(self._memory).set_value(finished.state)
        shown = context.get_discrete_state(self._shown).value()
        stages: tuple[Stage, Stage] = finished.state.stages.stage
        state.get_mutable_discrete_state(self._shown).SetFromVector(
            np.concatenate(
                [
                    [float(s) for s in stages],
                    finished.decision.target[-1].ravel(),
                    [finished.solve_time, shown[9] + 1.0, progress.begun_at],
                ]
            )
        )

    def _calc_age(self, context: Context, output: BasicVector) -> None:
        seen = float(context.get_discrete_state(self._shown).value()[10])
        output.SetFromVector([context.get_time() - seen])

    def _show(self, rows: slice) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(context.get_discrete_state(self._shown).value()[rows])

        return calc


def _check_delay(policy: DressingPolicy, period: float, delay: float) -> None:
    """Raises a ValueError if a plan would not be used when its committed steps end."""
    if not 0.0 < delay < period:
        raise ValueError(f"delay is {delay} s, expected between 0 and the period {period} s")
    committed = policy.parameters.committed_steps * policy.parameters.time_step
    if abs(committed - delay) > 1e-9:
        raise ValueError(f"delay is {delay} s, expected that of the committed steps")
