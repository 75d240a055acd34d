"""A release passes only while it is asked for, and once it is confirmed."""

from __future__ import annotations

from pydrake.systems.analysis import Simulator

from drake_dress.systems.all_above import AllAbove
from drake_dress.systems.release_gate import ReleaseGate, confirmed_at_once


def test_it_passes_for_good_once_confirmed_during_a_request() -> None:
    answers: list[bool] = []
    calls = []

    def confirm() -> bool:
        calls.append(True)
        return bool(answers and answers.pop(0))

    gate = ReleaseGate(confirm, 0.1)
    simulator = Simulator(gate)
    context = simulator.get_mutable_context()
    released = gate.GetOutputPort("release")
    asked = gate.GetInputPort("request")
    asked.FixValue(context, [0.0])
    simulator.AdvanceTo(0.55)
    assert not calls, "nobody is asked before the coat is laid"
    asked.FixValue(context, [1.0])
    simulator.AdvanceTo(1.05)
    assert len(calls) == 5
    assert released.Eval(context)[0] == 0.0
    answers.extend([False, True])
    simulator.AdvanceTo(1.35)
    assert released.Eval(context)[0] == 1.0
    asked.FixValue(context, [0.0])
    simulator.AdvanceTo(2.0)
    assert released.Eval(context)[0] == 1.0
    assert len(calls) == 7


def test_an_answer_without_a_request_opens_nothing() -> None:
    gate = ReleaseGate(confirmed_at_once, 0.1)
    simulator = Simulator(gate)
    gate.GetInputPort("request").FixValue(simulator.get_mutable_context(), [0.0])
    simulator.AdvanceTo(1.0)
    assert gate.GetOutputPort("release").Eval(simulator.get_context())[0] == 0.0


def test_all_above_needs_all() -> None:
    system = AllAbove(2, 0.04)
    context = system.CreateDefaultContext()
    for left, right in ((0.0, 0.0), (0.08, 0.0), (0.0, 0.08), (0.08, 0.08)):
        for port, value in zip(system.ports, (left, right), strict=True):
            port.FixValue(context, [value])
        both = system.get_output_port().Eval(context)[0]
        assert both == float(left > 0.04 and right > 0.04)
