"""Simulated driver of an arm, with the ports that Drake's Panda messages carry."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, Demultiplexer, PassThrough

from drake_dress.models.arm.chain import JointLimits
from drake_dress.models.arm.description import panda_urdf
from drake_dress.systems.command_guard import CommandGuard
from drake_dress.systems.external_torque import ExternalTorque

# Time constant of the arm's estimate of external torque, s.
_FILTER_TIME = 0.01
MODES = ("position_velocity", "position", "velocity")


class SimPandaDriver(Diagram):
    """Driver between an arm in a plant and the system that commands it.

    .. pydrake_system::

        name: SimPandaDriver
        input_ports:
        - state
        - actuation
        - position (in the modes that have it)
        - velocity (in the modes that have it)
        - fresh (optional)
        output_ports:
        - desired_state
        - position_commanded
        - position_measured
        - velocity_commanded
        - velocity_measured
        - acceleration_commanded
        - torque_commanded
        - torque_measured
        - torque_external
        - stop

    state: (14,) of the arm in the plant. actuation: (7,) net torque of its drives, N·m. position,
    velocity and all outputs of their kind: (7,) rad, rad/s, rad/s², N·m. fresh, stop, desired_state
    (14,): as in `CommandGuard`. Names and kinds are those of Drake's PandaCommandReceiver and
    PandaStatusSender. torque_commanded equals torque_measured, because the simulated drives apply
    the torque of the maker's control without delay. acceleration_commanded is 0, because commands
    have none.

    Args:
        start: (7,) joint angles at time 0, rad.
        limits: of the joints.
        period: of the plant, s.
        mode: one of `MODES`: the commanded quantities.
    """

    def __init__(
        self,
        start: np.ndarray,
        limits: JointLimits,
        period: float,
        mode: str = "position_velocity",
    ) -> None:
        super().__init__()
        if mode not in MODES:
            raise ValueError(f"mode is {mode}, expected one of {', '.join(MODES)}")
        builder = DiagramBuilder()
        guard = builder.AddNamedSystem(
            "command_guard",
            CommandGuard(start, limits, period, "position" in mode, "velocity" in mode),
        )
        measured = builder.AddNamedSystem("measured", Demultiplexer([7, 7]))
        torque = builder.AddNamedSystem("torque", PassThrough(7))
        felt = builder.AddNamedSystem(
            "external_torque", ExternalTorque(_arm_alone(), period, _FILTER_TIME)
        )
        still = builder.AddNamedSystem("no_acceleration", ConstantVectorSource(np.zeros(7)))

        builder.ExportInput(measured.get_input_port(), "state")
        builder.ConnectInput("state", felt.GetInputPort("state"))
        builder.ExportInput(torque.get_input_port(), "actuation")
        builder.ConnectInput("actuation", felt.GetInputPort("torque_measured"))
        for name in ("position", "velocity"):
            if name in mode:
                builder.ExportInput(guard.GetInputPort(name), name)
        builder.ExportInput(guard.GetInputPort("fresh"), "fresh")
        for name in ("desired_state", "position_commanded", "velocity_commanded", "stop"):
            builder.ExportOutput(guard.GetOutputPort(name), name)
        for k, name in enumerate(("position_measured", "velocity_measured")):
            builder.ExportOutput(measured.get_output_port(k), name)
        builder.ExportOutput(still.get_output_port(), "acceleration_commanded")
        for name in ("torque_commanded", "torque_measured"):
            builder.ExportOutput(torque.get_output_port(), name)
        builder.ExportOutput(felt.get_output_port(), "torque_external")
        builder.BuildInto(self)


def _arm_alone() -> MultibodyPlant:
    """Returns a plant with only a Panda, without gravity, as the arm's own control models it."""
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(panda_urdf()))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("panda_link0"))
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.Finalize()
    return plant
