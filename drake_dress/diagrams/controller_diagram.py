"""The controllers of a scenario by themselves, to be fed with observations from elsewhere."""

from __future__ import annotations

from pydrake.systems.framework import Diagram, DiagramBuilder, InputPortIndex

from drake_dress.diagrams.assemble import Parts
from drake_dress.diagrams.build import local_setup, predictor, rates
from drake_dress.diagrams.dressing import LocalSetup
from drake_dress.diagrams.station import MOTION
from drake_dress.models.sides import SIDES
from drake_dress.systems.global_mpc import GlobalMpc
from drake_dress.systems.human_predictor import HumanPredictor
from drake_dress.systems.local_controller import LocalCompensation
from drake_dress.systems.plan_follower import PlanFollower


def make_controller_diagram(p: Parts) -> Diagram:
    """Returns the predictor of the person, the global and, where there is one, local controller.

    Inputs: `garment_position`, `garment_velocity` (3m,) of the controller's garment, m, m/s;
    `joint_position` (18,), m; with a local controller `{left,right}_gripper_position` (3,), m.
    Outputs: `{left,right}_velocity_request` (3,), m/s, that a run gives to its safety governor.

    Args:
        p: of a run of the scenario; its station is not used.
    """
    builder = DiagramBuilder()
    parameters, timing = p.policy.parameters, rates(p.scenario)
    believed = predictor(p.scenario)
    local = local_setup(p.scenario, p.policy)
    seen = builder.AddNamedSystem(
        "human_predictor", HumanPredictor(believed, parameters.time_step, parameters.horizon)
    )
    mpc = builder.AddNamedSystem(
        "global_mpc", GlobalMpc(p.policy, timing.global_period, timing.global_delay)
    )
    builder.Connect(seen.get_output_port(), mpc.GetInputPort("predicted_joint_position"))
    joints = builder.ExportInput(seen.get_input_port(), "joint_position")
    garment = {
        quantity: builder.ExportInput(
            mpc.GetInputPort(f"garment_{quantity}"), f"garment_{quantity}"
        )
        for quantity in MOTION
    }
    asking: PlanFollower | LocalCompensation
    if local is None:
        asking = builder.AddNamedSystem("plan_follower", PlanFollower())
    else:
        near = HumanPredictor(believed, local.joints_step, local.joints_count)
        asking = _add_local(builder, local, near, joints, garment["position"])
    builder.Connect(mpc.GetOutputPort("plan"), asking.GetInputPort("plan"))
    for side in SIDES:
        request = f"{side}_velocity_request"
        builder.ExportOutput(asking.GetOutputPort(request), request)
    diagram = builder.Build()
    diagram.set_name("controllers")
    return diagram


def _add_local(
    builder: DiagramBuilder,
    local: LocalSetup,
    near: HumanPredictor,
    joints: InputPortIndex,
    garment: InputPortIndex,
) -> LocalCompensation:
    """Adds the local controller, and the prediction `near` at steps of its own; returns it."""
    controller: LocalCompensation = builder.AddNamedSystem("local_controller", local.system())
    builder.AddNamedSystem("near_human_predictor", near)
    builder.ConnectInput(joints, near.get_input_port())
    builder.ConnectInput(garment, controller.GetInputPort("garment_position"))
    builder.Connect(near.get_output_port(), controller.GetInputPort("predicted_joint_position"))
    for side in SIDES:
        name = f"{side}_gripper_position"
        builder.ExportInput(controller.GetInputPort(name), name)
    return controller
