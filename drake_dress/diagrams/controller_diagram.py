"""The controllers of a scenario alone, for observations from outside the diagram."""

from __future__ import annotations

from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, InputPortIndex

from drake_dress.diagrams.planning import OBSERVATIONS, ControlSetup, add_planning
from drake_dress.models.sides import SIDES

# Inputs of the diagram that replace outputs of the station.
_INPUTS = {source: name for name, source in OBSERVATIONS.items()} | {
    "estimate.garment_velocity": "garment_velocity"
}


def make_controller_diagram(control: ControlSetup) -> Diagram:
    """Returns the diagram of prediction, global controller and, if in use, local controller.

    Inputs: `garment_position`, `garment_velocity` (3m,) of the controller's garment, m, m/s;
    `joint_position` (18,), m; with a local controller `{left,right}_gripper_position` (3,), m.
    Outputs: `{left,right}_velocity_request` (3,), m/s, which a run passes to its safety governor.

    Args:
        control: the controllers of a run.
    """
    builder = DiagramBuilder()
    exported: dict[str, InputPortIndex] = {}

    def feed(source: str, port: InputPort) -> None:
        name = _INPUTS[source]
        if name in exported:
            builder.ConnectInput(exported[name], port)
        else:
            exported[name] = builder.ExportInput(port, name)

    planning = add_planning(builder, control, feed)
    for side in SIDES:
        request = f"{side}_velocity_request"
        builder.ExportOutput(planning.requests.GetOutputPort(request), request)
    diagram = builder.Build()
    diagram.set_name("controllers")
    return diagram
