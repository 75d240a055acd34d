"""The local controller as a Drake system."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State, ValueProducer

from drake_dress.models.control.local_control import (
    GlobalPlan,
    LocalController,
    LocalPlan,
    LocalState,
)
from drake_dress.models.immutable import Immutable
from drake_dress.models.sides import SIDES


@dataclass(frozen=True)
class _Memory(Immutable):
    """Result of the last solve; its plan is output once its delay has passed."""

    state: LocalState
    plan: LocalPlan
    solve_time: float = np.nan


@dataclass(frozen=True)
class _Solving(Immutable):
    """The solve in progress on the thread, if any; copies wait for the same result."""

    pending: Future[_Memory] | None = None


class LocalCompensation(LeafSystem):
    """Solves the local problem at a fixed rate; applies its feedback gains between solves.

    .. pydrake_system::

        name: LocalCompensation
        input_ports:
        - plan
        - garment_position
        - predicted_joint_position
        - left_gripper_position
        - right_gripper_position
        output_ports:
        - left_velocity_request
        - right_velocity_request
        - request_time
        - solve_time

    plan: GlobalPlan. garment_position: (3m,) of the controller's garment, m.
    predicted_joint_position: ((M+1)·18,), m: row 0 is now, then one row every `joints_step`.
    Gripper positions and requests: (3,) m and m/s. request_time: (1,) time of the observation that
    the requests are based on, s; old if a solver hangs. solve_time: (2,) wall time of the last
    finished solve, s, and the number of finished solves.

    A solve starts from the observation at k·period, and its plan is used from k·period + delay on,
    however long the solve takes: the run is the same on any machine. With `in_worker=True` it
    solves on a background thread.

    Args:
        controller: Solves the local problem.
        period: Time between solves, s.
        delay: Time from an observation to the use of its plan, s; less than the period.
        joints_step: Time between predicted joint positions, s.
        joints_count: M, number of predicted positions after the current one.
        feedback: Whether to apply feedback gains between solves.
        record: List to which each solved problem of every context is appended, if given.
        in_worker: Whether to solve on a background thread.
    """

    def __init__(
        self,
        controller: LocalController,
        period: float,
        delay: float,
        joints_step: float,
        joints_count: int,
        feedback: bool = True,
        record: list[Any] | None = None,
        in_worker: bool = False,
    ) -> None:
        super().__init__()
        if not 0.0 < delay < period:
            raise ValueError(f"delay is {delay} s, expected between 0 and the period, {period} s")
        self._controller = controller
        self._joints_step = joints_step
        self._feedback = feedback
        self._record = record
        self._threads = ThreadPoolExecutor(1, "local-controller") if in_worker else None
        self._solving = self.DeclareAbstractState(Value(_Solving()))
        resting = controller.resting(0.0)
        self._memory = self.DeclareAbstractState(Value(_Memory(LocalState(), resting)))
        self._plan = self.DeclareAbstractState(Value(resting))
        self._shown = self.DeclareDiscreteState([np.nan, 0.0])
        self.DeclareAbstractInputPort("plan", Value(GlobalPlan.resting()))
        count = len(controller.planner.mesh.rest_position)
        self.DeclareVectorInputPort("garment_position", 3 * count)
        self.DeclareVectorInputPort("predicted_joint_position", 18 * (joints_count + 1))
        for side in SIDES:
            self.DeclareVectorInputPort(f"{side}_gripper_position", 3)
        # for both grippers (2,3), so that the garment is evaluated once
        self._velocity = self.DeclareCacheEntry(
            "velocity",
            ValueProducer(allocate=Value(np.zeros((2, 3))).Clone, calc=self._calc_velocity),
        )
        for i, side in enumerate(SIDES):
            self.DeclareVectorOutputPort(f"{side}_velocity_request", 3, self._request(i))
        ticket = {self.abstract_state_ticket(self._plan)}
        self.DeclareVectorOutputPort("request_time", 1, self._calc_time, ticket)
        self.DeclareVectorOutputPort(
            "solve_time", 2, self._calc_solve_time, {self.discrete_state_ticket(self._shown)}
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._solve)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, delay, self._adopt)

    def _grippers(self, context: Context) -> np.ndarray:
        return np.stack(
            [self.GetInputPort(f"{side}_gripper_position").Eval(context) for side in SIDES]
        )

    def _garment(self, context: Context) -> np.ndarray:
        return self.GetInputPort("garment_position").Eval(context).reshape(-1, 3)

    def _solve(self, context: Context, state: State) -> None:
        begin = clock.perf_counter()
        memory: _Memory = context.get_abstract_state(self._memory).get_value()
        joints = self.GetInputPort("predicted_joint_position").Eval(context).reshape(-1, 6, 3)
        seen = (
            memory.state,
            self.GetInputPort("plan").Eval(context),
            self._garment(context).copy(),
            self._grippers(context),
            joints.copy(),
            self._joints_step,
            context.get_time(),
        )
        looked = clock.perf_counter() - begin
        if self._threads is not None:
            solving = _Solving(self._threads.submit(self._solved, looked, *seen))
            state.get_mutable_abstract_state(self._solving).set_value(solving)
        else:
            state.get_mutable_abstract_state(self._memory).set_value(self._solved(looked, *seen))

    def _solved(self, looked: float, *seen: Any) -> _Memory:
        """Returns the result of a solve; reading its inputs took `looked`, s."""
        begin = clock.perf_counter()
        outcome = self._controller.solve(*seen)
        if self._record is not None and outcome.problem is not None:
            self._record.append(outcome.problem)
        spent = np.nan if outcome.problem is None else looked + clock.perf_counter() - begin
        return _Memory(outcome.state, outcome.plan, spent)

    def _adopt(self, context: Context, state: State) -> None:
        memory: _Memory = context.get_abstract_state(self._memory).get_value()
        solving: _Solving = context.get_abstract_state(self._solving).get_value()
        if solving.pending is not None:
            memory = solving.pending.result()
            state.get_mutable_abstract_state(self._solving).set_value(_Solving())
            state.get_mutable_abstract_state(self._memory).set_value(memory)
        state.get_mutable_abstract_state(self._plan).set_value(memory.plan)
        if np.isfinite(memory.solve_time):
            ended = context.get_discrete_state(self._shown).value()[1] + 1.0
            state.get_mutable_discrete_state(self._shown).SetFromVector([memory.solve_time, ended])

    def _calc_velocity(self, context: Context, output: AbstractValue) -> None:
        plan: LocalPlan = context.get_abstract_state(self._plan).get_value()
        seen = None
        if self._feedback and len(plan.velocity):
            sleeves = self._controller.planner.sleeves(self._garment(context))
            centers = [sleeve.p_c for sleeve in sleeves]
            seen = np.concatenate([*centers, *self._grippers(context)])
        output.set_value(plan.velocity_at(context.get_time(), seen))

    def _request(self, side: int) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._velocity.Eval(context)[side])

        return calc

    def _calc_time(self, context: Context, output: BasicVector) -> None:
        plan: LocalPlan = context.get_abstract_state(self._plan).get_value()
        output.SetFromVector([plan.start])

    def _calc_solve_time(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._shown).value())
