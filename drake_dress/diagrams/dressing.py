"""The dressing diagram: station, controllers, recorder and live view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, OutputPort
from pydrake.systems.primitives import Multiplexer

from drake_dress.diagrams.arms import ArmSetup
from drake_dress.diagrams.planning import ControlSetup, LocalSetup, add_planning
from drake_dress.diagrams.station import MOTION, Station
from drake_dress.diagrams.wiring import Wiring
from drake_dress.models.control.local_control import LocalState
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.skin.person_skin import PersonSkin
from drake_dress.models.sides import SIDES
from drake_dress.report.log_writer import RunLogWriter
from drake_dress.systems.arm_controller import ArmController
from drake_dress.systems.garment_visualizer import GarmentVisualizer
from drake_dress.systems.global_mpc import GlobalMpc
from drake_dress.systems.run_recorder import RunRecorder
from drake_dress.systems.safety_governor import SafetyGovernor
from drake_dress.systems.skin_visualizer import SkinVisualizer


@dataclass(frozen=True)
class Dressing:
    """The whole diagram, and the parts of it that a run uses.

    Attributes:
        diagram: the whole diagram.
        station: with person, arms and garment, or with their messages.
        mpc: the global controller.
        local: the local controller, if there is one.
    """

    diagram: Diagram
    station: Station
    mpc: GlobalMpc
    local: LocalSetup | None

    def rehearse(
        self, garment: np.ndarray, joints: np.ndarray, stopped: Callable[[], bool] = lambda: False
    ) -> None:
        """Has each controller solve once, so that nothing is compiled during the run.

        Args:
            garment: (m,3) nodes of the controller's garment, m.
            joints: (6,3) joint positions of the person, m.
            stopped: returns whether to give up.
        """
        plan = self.mpc.rehearse(garment, joints, stopped)
        if plan is None or self.local is None:
            return
        still = np.tile(joints, (self.local.joints_count + 1, 1, 1))
        self.local.controller.solve(
            LocalState(),
            plan,
            garment,
            self.station.start_grippers,
            still,
            self.local.joints_step,
            0.0,
        )


@dataclass(frozen=True)
class _Controllers:
    """The systems that control the grippers, from the plan down to the arms' joints.

    Attributes:
        mpc: the global controller.
        requests: system that turns plans into requested velocities.
        governor: safety governor.
        arms: controller of the arms' joints; None where grippers float.
        forecast: port of the forecasts of the person; None where the predictor makes none.
    """

    mpc: GlobalMpc
    requests: Any
    governor: SafetyGovernor
    arms: ArmController | None
    forecast: OutputPort | None = None


def make_dressing(
    station: Station,
    mesh: GarmentMesh,
    control: ControlSetup,
    writer: RunLogWriter | None = None,
    meshcat: Meshcat | None = None,
    skin: PersonSkin | None = None,
) -> Dressing:
    """Returns station and controllers wired together.

    Args:
        station: simulated or hardware; only its exported ports are used.
        mesh: the true garment; the controller's if the true one is unknown.
        control: the controllers.
        writer: open log, if one is kept.
        meshcat: page that shows the run, if any.
        skin: the person's skin that it shows, if any.
    """
    w = Wiring(station)
    controllers = _add_controllers(w, control)
    if writer is not None:
        _add_recorder(w, writer, mesh, control, controllers)
    if meshcat is not None:
        _add_visualizer(w, meshcat, mesh, controllers)
        if skin is not None:
            shown = w.add("skin_visualizer", SkinVisualizer(meshcat, skin))
            w.connect(w.station, w.true("joint_position"), shown, "joint_position")
    diagram = w.builder.Build()
    diagram.set_name("dressing")
    return Dressing(diagram, station, controllers.mpc, control.local)


def _add_controllers(w: Wiring, control: ControlSetup) -> _Controllers:
    """Adds the controllers, wired to each other and to the station."""
    planning = add_planning(w.builder, control, w.feed, waits=not w.of.in_real_time)
    governor = add_governor(w, control)
    wire_governor(w, planning.requests, governor)
    arms = command_grippers(w, control, governor)
    w.connect(planning.mpc, "release", w.station, "release")
    w.connect(w.station, "grippers_open", planning.mpc, "grippers_open")
    if w.station.HasInputPort("cue"):
        w.connect(planning.mpc, "cue", w.station, "cue")
    return _Controllers(planning.mpc, planning.requests, governor, arms, planning.forecast)


def add_governor(w: Wiring, control: ControlSetup) -> SafetyGovernor:
    """Adds the safety governor of a setup, not yet wired."""
    governor: SafetyGovernor = w.add(
        "safety_governor",
        SafetyGovernor(
            w.of.start_grippers,
            control.rates.command_period,
            control.limits,
            control.policy.person,
            control.policy.held_offsets,
        ),
    )
    return governor


def command_grippers(
    w: Wiring, control: ControlSetup, governor: SafetyGovernor
) -> ArmController | None:
    """Makes the grippers follow the governor's commands.

    Returns:
        The controller of the arms; None where grippers float.
    """
    if w.of.robots is not None:
        return _add_arms(w, w.of.robots, control, governor)
    for side in SIDES:
        command = f"{side}_gripper.position_command"
        w.connect(governor, f"{side}_position_command", w.station, command)
    return None


def wire_governor(w: Wiring, requests: Any, governor: SafetyGovernor) -> None:
    """Connects the governor to the station's measurements and to a system's requests.

    Args:
        w: the diagram being built.
        requests: a system with outputs `{left,right}_velocity_request` and `request_time`.
        governor: safety governor.
    """
    w.connect(requests, "request_time", governor, "request_time")
    w.connect(w.station, "permission", governor, "permission")
    w.connect(w.station, "estimate.joint_position", governor, "joint_position")
    _show_grippers(w, governor, "position", "force")
    for side in SIDES:
        w.connect(requests, f"{side}_velocity_request", governor, f"{side}_velocity_request")


def _show_grippers(w: Wiring, system: Any, *quantities: str) -> None:
    """Connects the station's measurements of both grippers."""
    for side in SIDES:
        for quantity in quantities:
            measured = f"{side}_gripper.{quantity}_measured"
            w.connect(w.station, measured, system, f"{side}_gripper_{quantity}")


def _add_arms(
    w: Wiring,
    robots: ArmSetup,
    control: ControlSetup,
    governor: SafetyGovernor,
) -> ArmController:
    """Adds the arm controller, which moves the joints so that grippers follow the governor."""
    arms = w.add(
        "arm_controller",
        ArmController(
            robots.pair,
            robots.start,
            control.rates.arm_period,
            control.policy.person,
            control.rates.arm_offset,
        ),
    )
    w.connect(w.station, "estimate.joint_position", arms, "joint_position")
    for side in SIDES:
        w.connect(w.station, f"{side}_arm.position_measured", arms, f"{side}_arm_position")
        w.connect(w.station, f"{side}_arm.stopped", arms, f"{side}_arm_stopped")
        for quantity in MOTION:
            w.connect(governor, f"{side}_{quantity}_command", arms, f"{side}_{quantity}_command")
            command = f"{side}_arm.{quantity}"
            if w.station.HasInputPort(command):
                w.connect(arms, f"{side}_arm_{quantity}_command", w.station, command)
    return arms


def _add_recorder(
    w: Wiring,
    writer: RunLogWriter,
    mesh: GarmentMesh,
    control: ControlSetup,
    controllers: _Controllers,
) -> None:
    """Adds the system that logs true values where they are known, otherwise estimates."""
    policy, rates, arms = control.policy, control.rates, controllers.arms
    recorder = w.add(
        "run_recorder",
        RunRecorder(
            writer,
            mesh,
            len(policy.mesh.rest_position),
            w.of.person.placed_capsules if w.sees_truth else policy.person,
            rates.log_period,
            rates.command_period,
            control.local is not None,
            None if arms is None else rates.plant_period,
            has_forecast=controllers.forecast is not None,
        ),
    )
    if controllers.forecast is not None:
        w.builder.Connect(controllers.forecast, recorder.GetInputPort("forecast"))
    if arms is not None:
        w.connect(arms, "clearance", recorder, "clearance")
        for side in SIDES:
            w.connect(arms, f"{side}_arm_position_command", recorder, f"{side}_arm_command")
            for quantity in ("position", "velocity", "torque"):
                measured = f"{side}_arm.{quantity}_measured"
                w.connect(w.station, measured, recorder, f"{side}_arm_{quantity}")
    if control.local is not None:
        w.connect(controllers.requests, "solve_time", recorder, "local_solve_time")
    if w.sees_truth:
        for name in ("contact", "contact_force", "body_poses", "intent"):
            w.connect(w.station, f"cheat_{name}", recorder, name)
    for name in ("garment_position", "joint_position"):
        w.connect(w.station, w.true(name), recorder, name)
    w.connect(w.station, "estimate.joint_position", recorder, "estimated_joint_position")
    w.connect(w.station, "estimate.garment_position", recorder, "estimated_position")
    w.connect(controllers.mpc, "stage", recorder, "stage")
    w.connect(controllers.mpc, "solve_time", recorder, "solve_time")
    w.connect(controllers.governor, "verdict", recorder, "verdict")
    _show_grippers(w, recorder, "position", "force")


def _add_visualizer(
    w: Wiring, meshcat: Meshcat, mesh: GarmentMesh, controllers: _Controllers
) -> None:
    """Adds the live view of garment, grippers, targets and what is foreseen of the person."""
    shown = w.add(
        "garment_visualizer", GarmentVisualizer(meshcat, mesh.faces, len(mesh.rest_position))
    )
    grippers = w.builder.AddSystem(Multiplexer([3, 3]))
    for i, side in enumerate(SIDES):
        measured = w.station.GetOutputPort(f"{side}_gripper.position_measured")
        w.builder.Connect(measured, grippers.get_input_port(i))
    w.builder.Connect(grippers.get_output_port(), shown.GetInputPort("gripper_position"))
    w.connect(w.station, w.true("garment_position"), shown, "garment_position")
    w.connect(controllers.mpc, "target", shown, "targets")
    w.connect(controllers.mpc, "stage", shown, "stage")
    if controllers.forecast is not None:
        w.builder.Connect(controllers.forecast, shown.GetInputPort("forecast"))
