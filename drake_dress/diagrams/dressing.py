"""The dressing diagram: station, what is seen of it, controllers, and what is shown and logged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import Multiplexer

from drake_dress.diagrams.hardware_station import HardwareStation
from drake_dress.diagrams.station import Station
from drake_dress.models.control.local_control import LocalController, LocalState
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.models.control.safety import SafetyLimits
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.prediction import MotionPredictor, StillPredictor
from drake_dress.models.sides import SIDES
from drake_dress.report.log_writer import RunLogWriter
from drake_dress.systems.arm_controller import ArmController
from drake_dress.systems.garment_visualizer import GarmentVisualizer
from drake_dress.systems.global_mpc import GlobalMpc
from drake_dress.systems.human_predictor import HumanPredictor
from drake_dress.systems.local_controller import LocalCompensation
from drake_dress.systems.plan_follower import PlanFollower
from drake_dress.systems.run_recorder import RunRecorder
from drake_dress.systems.safety_governor import SafetyGovernor


@dataclass(frozen=True)
class Rates:
    """Periods and delays of the controllers, and of the plant, s."""

    global_period: float = 0.5
    global_delay: float = 0.2
    command_period: float = 0.01
    log_period: float = 1.0 / 30.0
    arm_period: float = 0.005
    plant_period: float = 0.004
    arm_offset: float = 0.0005


@dataclass(frozen=True)
class LocalSetup:
    """The local controller, and how often it is asked.

    Attributes:
        controller: does the work.
        period: between solves, s. delay: of their use, s.
        feedback: whether it corrects between solves.
        joints_step: between the joints predicted for it, s; joints_count: how many beyond now.
        record: takes each problem that it solves, if given.
    """

    controller: LocalController
    period: float
    delay: float
    feedback: bool
    joints_step: float
    joints_count: int
    record: list[LocalProblem] | None = None

    def system(self, beside: bool = False) -> LocalCompensation:
        """Returns it as a system; `beside` the rest it solves on a thread."""
        return LocalCompensation(
            self.controller,
            self.period,
            self.delay,
            self.joints_step,
            self.joints_count,
            self.feedback,
            self.record,
            beside,
        )


@dataclass(frozen=True)
class Dressing:
    """The whole diagram, and of what it is made that a run asks for something.

    Attributes:
        diagram: the whole.
        station: with people, arms and garment, or the messages of these.
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
        """Has each controller solve once, so that nothing is compiled when time counts.

        Args:
            garment: (m,3) of the controller's garment, m.
            joints: (6,3) of the person, m.
            stopped: whether to give up.
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


def make_dressing(
    station: Station,
    mesh: GarmentMesh,
    policy: DressingPolicy,
    rates: Rates,
    limits: SafetyLimits,
    writer: RunLogWriter | None = None,
    meshcat: Meshcat | None = None,
    predictor: MotionPredictor | None = None,
    local: LocalSetup | None = None,
    beside: bool = False,
) -> Dressing:
    """Returns station and controllers wired together.

    Args:
        station: simulated or hardware; only its exported ports are used.
        mesh: the true garment; where it is not known, the controller's.
        policy: of the global controller, with the controller's garment.
        rates: of controllers and log.
        limits: that stand between controllers and grippers.
        writer: open log, if one is kept.
        meshcat: where the run is shown, if it is.
        predictor: what is believed of how the arms move on; that they stay, when None.
        local: the local controller between plan and governor; the plan is followed when None.
        beside: whether controllers solve beside the rest, the global one in a process of its own.
    """
    builder = DiagramBuilder()
    lab = builder.AddNamedSystem("station", station.diagram)
    believed = predictor or StillPredictor()
    p = policy.parameters
    predicted = builder.AddNamedSystem(
        "human_predictor", HumanPredictor(believed, p.time_step, p.horizon)
    )
    mpc = builder.AddNamedSystem(
        "global_mpc",
        GlobalMpc(
            policy,
            rates.global_period,
            rates.global_delay,
            waits=not isinstance(station, HardwareStation),
            beside=beside,
        ),
    )
    if local is None:
        asking = builder.AddNamedSystem("plan_follower", PlanFollower())
    else:
        asking = builder.AddNamedSystem("local_controller", local.system(beside))
    governor = builder.AddNamedSystem(
        "safety_governor",
        SafetyGovernor(
            station.start_grippers, rates.command_period, limits, policy.person, policy.held_offsets
        ),
    )

    def connect(source, output: str, target, port: str) -> None:  # type: ignore[no-untyped-def]
        builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))

    connect(lab, "estimate.joint_position", predicted, "joint_position")
    for quantity in ("position", "velocity"):
        connect(lab, f"estimate.garment_{quantity}", mpc, f"garment_{quantity}")
    connect(predicted, "predicted_joint_position", mpc, "predicted_joint_position")
    if local is not None:
        soon = builder.AddNamedSystem(
            "near_human_predictor", HumanPredictor(believed, local.joints_step, local.joints_count)
        )
        connect(lab, "estimate.joint_position", soon, "joint_position")
        connect(lab, "estimate.garment_position", asking, "garment_position")
        connect(soon, "predicted_joint_position", asking, "predicted_joint_position")
        for side in SIDES:
            connect(lab, f"{side}_gripper.position_measured", asking, f"{side}_gripper_position")
    connect(mpc, "plan", asking, "plan")
    connect(asking, "request_time", governor, "request_time")
    connect(lab, "permission", governor, "permission")
    connect(lab, "estimate.joint_position", governor, "joint_position")
    for side in SIDES:
        for quantity in ("position", "force"):
            connect(
                lab, f"{side}_gripper.{quantity}_measured", governor, f"{side}_gripper_{quantity}"
            )
        connect(asking, f"{side}_velocity_request", governor, f"{side}_velocity_request")
        if station.robots is None:
            connect(governor, f"{side}_position_command", lab, f"{side}_gripper.position_command")
    arms = None
    if station.robots is not None:
        arms = builder.AddNamedSystem(
            "arm_controller",
            ArmController(
                station.robots.pair,
                station.robots.start,
                rates.arm_period,
                policy.person,
                rates.arm_offset,
            ),
        )
        connect(lab, "estimate.joint_position", arms, "joint_position")
        for side in SIDES:
            connect(lab, f"{side}_arm.position_measured", arms, f"{side}_arm_position")
            connect(lab, f"{side}_arm.stopped", arms, f"{side}_arm_stopped")
            for quantity in ("position", "velocity"):
                connect(governor, f"{side}_{quantity}_command", arms, f"{side}_{quantity}_command")
                if lab.HasInputPort(f"{side}_arm.{quantity}"):
                    connect(arms, f"{side}_arm_{quantity}_command", lab, f"{side}_arm.{quantity}")

    true = lab.HasOutputPort("cheat_garment_position")
    if writer is not None:
        capsules = [(int(station.person.body_indices[c.body]), c) for c in station.person.capsules]
        recorder = builder.AddNamedSystem(
            "run_recorder",
            RunRecorder(
                writer,
                mesh,
                len(policy.mesh.rest_position),
                capsules if true else policy.person,
                rates.log_period,
                rates.command_period,
                local is not None,
                None if arms is None else rates.plant_period,
            ),
        )
        if arms is not None:
            connect(arms, "clearance", recorder, "clearance")
            for side in SIDES:
                connect(arms, f"{side}_arm_position_command", recorder, f"{side}_arm_command")
                for quantity in ("position", "velocity", "torque"):
                    connect(
                        lab, f"{side}_arm.{quantity}_measured", recorder, f"{side}_arm_{quantity}"
                    )
        if local is not None:
            connect(asking, "solve_time", recorder, "local_solve_time")
        if true:
            for name in ("contact", "contact_force", "body_poses"):
                connect(lab, f"cheat_{name}", recorder, name)
        for name in ("garment_position", "joint_position"):
            connect(lab, f"cheat_{name}" if true else f"estimate.{name}", recorder, name)
        connect(lab, "estimate.joint_position", recorder, "estimated_joint_position")
        connect(lab, "estimate.garment_position", recorder, "estimated_position")
        connect(mpc, "stage", recorder, "stage")
        connect(mpc, "solve_time", recorder, "solve_time")
        connect(governor, "verdict", recorder, "verdict")
        for side in SIDES:
            for quantity in ("position", "force"):
                connect(
                    lab,
                    f"{side}_gripper.{quantity}_measured",
                    recorder,
                    f"{side}_gripper_{quantity}",
                )
    if meshcat is not None:
        shown = builder.AddNamedSystem(
            "garment_visualizer", GarmentVisualizer(meshcat, mesh.faces, len(mesh.rest_position))
        )
        grippers = builder.AddSystem(Multiplexer([3, 3]))
        for i, side in enumerate(SIDES):
            builder.Connect(
                lab.GetOutputPort(f"{side}_gripper.position_measured"), grippers.get_input_port(i)
            )
        builder.Connect(grippers.get_output_port(), shown.GetInputPort("gripper_position"))
        connect(
            lab,
            "cheat_garment_position" if true else "estimate.garment_position",
            shown,
            "garment_position",
        )
        connect(mpc, "target", shown, "targets")
        connect(mpc, "stage", shown, "stage")
    diagram = builder.Build()
    diagram.set_name("dressing")
    return Dressing(diagram, station, mpc, local)
