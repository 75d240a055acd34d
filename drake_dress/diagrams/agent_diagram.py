"""A station whose grippers are moved by an agent instead of the controllers."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.systems.framework import Diagram

from drake_dress.diagrams.assemble import Parts
from drake_dress.diagrams.dressing import add_governor, command_grippers, wire_governor
from drake_dress.diagrams.planning import ControlSetup
from drake_dress.diagrams.wiring import Wiring
from drake_dress.systems.agent_request import AgentRequest
from drake_dress.systems.safety_governor import SafetyGovernor


@dataclass(frozen=True)
class AgentDiagram:
    """The diagram and the systems that an agent's environment reads.

    Attributes:
        diagram: with the input `velocity`, (6,) of left, then right gripper, m/s.
        governor: safety governor between the agent and the grippers.
    """

    diagram: Diagram
    governor: SafetyGovernor


def make_agent_diagram(p: Parts) -> AgentDiagram:
    """Returns the diagram of a scenario's parts, with an agent in place of the controllers.

    Station, safety governor and, if there are any, arms with their controller are those of a run.
    There is no planning.
    """
    w = Wiring(p.station)
    control = ControlSetup(p.policy, p.setup.rates, p.setup.limits)
    agent = w.add("agent", AgentRequest())
    governor = add_governor(w, control)
    wire_governor(w, agent, governor)
    command_grippers(w, control, governor)
    w.builder.ExportInput(agent.get_input_port(), "velocity")
    diagram = w.builder.Build()
    diagram.set_name("agent_dressing")
    return AgentDiagram(diagram, governor)
