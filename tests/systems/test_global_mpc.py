"""The global controller where the world does not wait for it."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from time import sleep
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_dress.models.control.local_control import GlobalPlan
from drake_dress.models.control.policy import DressingPolicy, PolicyParameters
from drake_dress.models.dressing.finish import FinishParameters, FinishState
from drake_dress.systems.global_mpc import GlobalMpc

pytestmark = pytest.mark.alone
_PERIOD, _DELAY, _FAILS = 0.5, 0.2, 0.9


@dataclass
class _Policy(DressingPolicy):
    """Asks for motion, and stops to do so at a time."""

    ends: str
    parameters: PolicyParameters = PolicyParameters(time_step=0.1, horizon=8)
    mesh: Any = field(default_factory=lambda: SimpleNamespace(rest_position=np.zeros((1, 3))))
    planner: Any = None
    lowers: bool = False

    def initial_state(self) -> Any:
        return SimpleNamespace(shown=(0, 0), finish=FinishState())

    def decide(
        self,
        state: Any,
        x: Any,
        v: Any,
        joints: Any,
        time: float,
        elapsed_steps: float = 5.0,
        radius: Any = None,
        are_open: bool = False,
    ) -> Any:
        n = self.parameters.horizon
        if time > _FAILS:
            if self.ends == "raises":
                raise ValueError("the garment is gone")
            if self.ends == "dies":
                os._exit(3)
            sleep({"hangs": 600.0, "is late": 1.3}[self.ends])
        plan = SimpleNamespace(velocity=np.full((n, 2, 3), 0.1), armhole=np.zeros((n, 2, 3)))
        return state, SimpleNamespace(
            plan=plan,
            assignment="some",
            target=np.zeros((n, 2, 3)),
            release=False,
            lowers=self.lowers,
        )


def test_a_controller_that_has_no_plan_any_more_asks_for_rest() -> None:
    failures = {
        "raises": "global controller: ValueError: the garment is gone",
        "dies": "global controller: BrokenProcessPool",
        "hangs": "global controller: no plan for 1.8 s",
        "is late": None,
    }
    builder = DiagramBuilder()
    controllers = {}
    for ends in failures:
        mpc = GlobalMpc(_Policy(ends), _PERIOD, _DELAY, waits=False, patience=1.8)
        controllers[ends] = builder.AddNamedSystem(ends, mpc)
        for i in range(3):
            port = mpc.get_input_port(i)
            source = builder.AddSystem(ConstantVectorSource(np.zeros(port.size())))
            builder.Connect(source.get_output_port(), port)
    simulator = Simulator(builder.Build())
    for mpc in controllers.values():
        mpc.rehearse(np.zeros((1, 3)), np.zeros((6, 3)), lambda: False)
    simulator.set_target_realtime_rate(1.0)
    plans: dict[str, list[GlobalPlan]] = {ends: [] for ends in failures}
    for k in range(1, 36):
        simulator.AdvanceTo(0.1 * k)
        for ends, mpc in controllers.items():
            context = mpc.GetMyContextFromRoot(simulator.get_context())
            plans[ends].append(mpc.GetOutputPort("plan").Eval(context))
    for ends, failure in failures.items():
        moves = np.array([bool(plan.velocity.any()) for plan in plans[ends]])
        # seen at 0.5 s, used from 0.7 s to 1.3 s, and for another period
        assert moves[7:10].all(), ends
        first = int(np.argmin(moves[7:])) + 7
        assert not moves[first], ends
        assert 0.1 * first <= 1.3 + _PERIOD + 0.11, ends
        mpc = controllers[ends]
        found = mpc.failure(mpc.GetMyContextFromRoot(simulator.get_context()))
        if failure is None:
            assert found is None
            assert moves[first:].any(), "it goes on with the plan that came late"
        else:
            assert not moves[first:].any(), ends
            assert found is not None
            assert found.startswith(failure)


def test_a_run_is_finished_while_sleeves_that_are_done_are_still_on() -> None:
    """Stages are of a while ago; what is seen now counts as well."""
    looked = []

    def are_on(x: Any, joints: Any) -> bool:
        looked.append((x.shape, joints.shape))
        return bool(x[0, 2] > 1.0)

    policy = _Policy("hangs")
    policy.planner = SimpleNamespace(are_on=are_on)
    policy.finish = FinishParameters(release=False)
    mpc = GlobalMpc(policy, _PERIOD, _DELAY, waits=True)
    context = mpc.CreateDefaultContext()
    for port in range(3):
        size = mpc.get_input_port(port).size()
        mpc.get_input_port(port).FixValue(context, np.full(size, 2.0 if port == 0 else 0.0))
    shown = context.get_discrete_state(0).value().copy()
    for stages, height, finished in (
        ((2, 2), 2.0, True),
        ((2, 2), 0.5, False),
        ((1, 2), 2.0, False),
        ((2, 0), 2.0, False),
    ):
        shown[:2] = stages
        context.SetDiscreteState(0, shown)
        mpc.get_input_port(0).FixValue(context, np.full(3, height))
        assert mpc.is_finished(context) == finished
    assert looked == [((1, 3), (6, 3))] * 2


def test_the_person_is_told_to_lower_the_arms_as_the_plan_in_use_says() -> None:
    mpc = GlobalMpc(_Policy("hangs"), _PERIOD, _DELAY, waits=True)
    context = mpc.CreateDefaultContext()
    assert mpc.GetOutputPort("cue").Eval(context) == [0.0]
    for lowers in (True, False):
        context.SetAbstractState(mpc._plan, replace(GlobalPlan.resting(), lowers=lowers))
        assert mpc.GetOutputPort("cue").Eval(context) == [float(lowers)]
