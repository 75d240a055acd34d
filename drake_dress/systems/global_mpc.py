"""The global controller as a Drake system."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from concurrent.futures import Future, wait
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_dress.models.control.local_control import GlobalPlan
from drake_dress.models.control.policy import Decision, DressingPolicy, PolicyState
from drake_dress.models.dressing.finish import Phase
from drake_dress.models.dressing.stages import Stage
from drake_dress.models.immutable import Immutable
from drake_dress.systems.worker_process import WorkerProcess, on_a_thread

# Polling period for a finished plan if `waits` is False, s.
_LOOKING_PERIOD = 0.01
# Polling period for the request to stop a rehearsal, s.
_REHEARSAL_STEP = 0.05
# Time for which both sleeves must stay on if the coat is not let go, s.
_STAY = 1.0


@dataclass(frozen=True)
class _Finished:
    decision: Decision
    state: PolicyState
    joints: np.ndarray
    solve_time: float


@dataclass(frozen=True)
class _Progress(Immutable):
    """The solve in progress in a context, if any.

    A copy of the context waits for the same result: a solve depends on its inputs only, and a
    Future can be read more than once.

    Attributes:
        pending: Future result; None while no solve is in progress.
        begun_at: Start time of the last solve, s.
        failure: Reason why planning has ended; None otherwise.
    """

    pending: Future[_Finished] | None = None
    begun_at: float = 0.0
    failure: str | None = None


@dataclass(frozen=True)
class _Solve:
    """One solve, in a thread or a worker process."""

    policy: DressingPolicy

    def __call__(
        self,
        memory: PolicyState,
        x: np.ndarray,
        v: np.ndarray,
        joints: np.ndarray,
        now: float,
        steps: float,
        radius: np.ndarray | None = None,
        are_open: bool = False,
    ) -> _Finished:
        begin = clock.perf_counter()
        state, decision = self.policy.decide(memory, x, v, joints, now, steps, radius, are_open)
        return _Finished(decision, state, joints, clock.perf_counter() - begin)


class GlobalMpc(LeafSystem):
    """Solves for a plan at a fixed rate and outputs it after a modelled delay.

    .. pydrake_system::

        name: GlobalMpc
        input_ports:
        - garment_position
        - garment_velocity
        - predicted_joint_position
        - predicted_radius (optional)
        - grippers_open (optional)
        output_ports:
        - plan
        - stage
        - target
        - solve_time
        - age
        - release
        - cue

    garment_*: (3m,) of the controller's garment, m, m/s. predicted_radius: ((N+1)·6,) of the balls
    that hold the predicted joints with probability 0.9, m. grippers_open: (1,) 1 once both have let
    go. plan: GlobalPlan. stage: (2,) 0 prepare, 1 dress, 2 done, 3 lay, 4 released. target: (6,)
    target positions of left and right armhole, m. solve_time: (2,) wall time of the last finished
    solve, s, and the number of finished solves. age: (1,) time since the observation that the plan
    in use is based on, s. release: (1,) 1 once the coat is laid: the grippers are to open. cue:
    (1,) 1 while the person is to lower the arms: while the coat is laid, and before it if a sleeve
    stalls beyond the elbow.

    A solve starts from the observation at k·period, and its plan is used from k·period + delay on,
    however long the solve takes: the run is the same on any machine. Solves run on a background
    thread. With `in_worker=True` they run in a worker process, which competes less with the rest of
    the diagram.

    With `waits=False`, time does not wait for a solve (hardware). Solves then run in a worker
    process, one at a time. A plan is used from k·period + delay on, or once it is ready if that is
    later. The prediction includes the last plan's motion until then. If no new plan arrives within
    one period after the last one ends, the grippers rest. A solve that fails, or takes longer than
    `patience`, ends planning.

    Args:
        policy: Computes the plans.
        period: Time between solves, s.
        delay: Time from an observation to the use of its plan, s; less than the period and equal to
            the duration of the policy's committed steps.
        waits: Whether simulated time waits for a solve that takes longer than its delay.
        patience: Longest permitted solve if `waits` is False, s.
        in_worker: Whether solves run in a worker process even if `waits` is True.

    All state of a run is in its context, so several simulators of one diagram give the same results
    as each alone. They share the thread or process that solves, one solve after another. With
    `waits=False`, a failure in one also ends the solve in progress of another.
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
            self._submit: Callable[..., Future[_Finished]] = on_a_thread(solve, "global-mpc")
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
        # the outputs of `_show`, and the time of the observation that the plan in use is based on
        self._shown = self.DeclareDiscreteState(np.zeros(11))
        self.DeclareVectorInputPort("garment_position", 3 * m)
        self.DeclareVectorInputPort("garment_velocity", 3 * m)
        self.DeclareVectorInputPort("predicted_joint_position", 18 * (n + 1))
        self.DeclareVectorInputPort("predicted_radius", 6 * (n + 1))
        self._open = self.DeclareVectorInputPort("grippers_open", 1)
        self._declare_outputs()
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._begin)
        if waits:
            self.DeclarePeriodicUnrestrictedUpdateEvent(period, delay, self._finish)
        else:
            self.DeclarePeriodicUnrestrictedUpdateEvent(_LOOKING_PERIOD, 0.0, self._look)

    def _declare_outputs(self) -> None:
        """Declares the output ports; all except `age` depend on state only."""
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
        planned = {self.abstract_state_ticket(self._plan)}
        self.DeclareVectorOutputPort("release", 1, self._calc_release, planned)
        self.DeclareVectorOutputPort("cue", 1, self._calc_cue, planned)

    def rehearse(
        self, x: np.ndarray, joints: np.ndarray, stopped: Callable[[], bool]
    ) -> GlobalPlan | None:
        """Solves once from the start of a run without affecting the run, and returns the plan.

        The first solve may take a minute, because it compiles its kernels.

        Args:
            x: (m,3) controller's garment, m.
            joints: (6,3) joints, assumed to stay at rest, m.
            stopped: Returns whether to give up; the result is then None.
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
        """Returns the plan after its committed steps, which end at time `start`."""
        decision, p = finished.decision, self._policy.parameters
        first = p.committed_steps
        return GlobalPlan(
            start,
            p.time_step,
            decision.plan.velocity[first:],
            decision.plan.armhole[first - 1 :],
            decision.assignment,
            finished.joints[first:] if p.plans else None,
            decision.release,
            finished.state.finish.phase == Phase.RELEASED,
            decision.lowers,
        )

    def failure(self, context: Context) -> str | None:
        """Returns why planning has ended, from this system's own context; None if it has not."""
        return self._progress_in(context).failure

    def is_finished(self, context: Context) -> bool:
        """Returns whether nothing is left to do, from this system's own context.

        If the coat is let go in the end, the grippers have opened. Otherwise both sleeves are done
        and still on. The stages are those of the plan in use, about a second old. A sleeve may have
        slipped since then, so the current observation is checked, too.
        """
        if self._policy.finish.release:
            memory: PolicyState = context.get_abstract_state(self._memory).get_value()
            return memory.finish.phase == Phase.RELEASED
        if np.any(context.get_discrete_state(self._shown).value()[:2] < Stage.DONE):
            return False
        x = self.get_input_port(0).Eval(context).reshape(-1, 3)
        joints = self.get_input_port(2).Eval(context).reshape(-1, 6, 3)
        return self._policy.planner.are_on(x, joints[0])

    @property
    def watch_time(self) -> float:
        """Time for which a run goes on after `is_finished` holds, s."""
        finish = self._policy.finish
        return finish.watch_time if finish.release else _STAY

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
        radius = None
        if self.get_input_port(3).HasValue(context):
            radius = self.get_input_port(3).Eval(context).reshape(-1, 6).copy()
        memory = context.get_abstract_state(self._memory).get_value()
        # count missed periods as elapsed
        periods = max(1, round((now - progress.begun_at) / self._period))
        steps = periods * self._period / self._policy.parameters.time_step
        are_open = self._open.HasValue(context) and bool(self._open.Eval(context)[0] > 0.5)
        pending = self._submit(memory, x, v, joints, now, steps, radius, are_open)
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
            # nothing waits for the worker any more, and it must not delay the end of this process
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
        state.get_mutable_discrete_state(self._shown).SetFromVector(
            np.concatenate(
                [
                    [float(s) for s in finished.state.shown],
                    finished.decision.target[-1].ravel(),
                    [finished.solve_time, shown[9] + 1.0, progress.begun_at],
                ]
            )
        )

    def _calc_age(self, context: Context, output: BasicVector) -> None:
        seen = float(context.get_discrete_state(self._shown).value()[10])
        output.SetFromVector([context.get_time() - seen])

    def _calc_cue(self, context: Context, output: BasicVector) -> None:
        plan: GlobalPlan = context.get_abstract_state(self._plan).get_value()
        output.SetFromVector([float(plan.lowers)])

    def _calc_release(self, context: Context, output: BasicVector) -> None:
        plan: GlobalPlan = context.get_abstract_state(self._plan).get_value()
        output.SetFromVector([float(plan.release)])

    def _show(self, rows: slice) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(context.get_discrete_state(self._shown).value()[rows])

        return calc


def _check_delay(policy: DressingPolicy, period: float, delay: float) -> None:
    """Raises a ValueError unless the delay equals the duration of the committed steps."""
    if not 0.0 < delay < period:
        raise ValueError(f"delay is {delay} s, expected between 0 and the period {period} s")
    committed = policy.parameters.committed_steps * policy.parameters.time_step
    if abs(committed - delay) > 1e-9:
        raise ValueError(f"delay is {delay} s, expected that of the committed steps")
