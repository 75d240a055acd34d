"""The simulated driver: its reports, its estimate of external torque, and its own stops."""

import numpy as np
import numpy.typing as npt
import pytest
from pydrake.manipulation import PandaStatusReceiver, PandaStatusSender
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from drake_dress.diagrams.arms import HOME, PlantArm, add_arms
from drake_dress.diagrams.panda_driver import SimPandaDriver
from drake_dress.models.arm.command_guard import Stop
from drake_dress.models.arm.external_load import tool_force
from drake_dress.models.arm.panda import LIMITS
from drake_dress.models.sides import SIDES

H = 0.004
STILL = np.zeros(7)


class Rig:
    """One arm of two, its driver and its commands."""

    def __init__(self, mode: str = "position_velocity") -> None:
        builder = DiagramBuilder()
        self.plant: MultibodyPlant = builder.AddSystem(MultibodyPlant(H))
        bases = {side: np.eye(4) for side in SIDES}
        bases["left"][1, 3] = 1.0
        self.arm: PlantArm = add_arms(self.plant, bases)["left"]
        self.plant.Finalize()
        other = self.plant.GetModelInstanceByName("right_arm")
        for model in (self.arm.model, other):
            self.plant.SetDefaultPositions(model, HOME)
        self.driver = builder.AddNamedSystem("driver", SimPandaDriver(HOME, LIMITS, H, mode))
        for port, name in (
            (self.plant.get_state_output_port(self.arm.model), "state"),
            (self.plant.get_net_actuation_output_port(self.arm.model), "actuation"),
        ):
            builder.Connect(port, self.driver.GetInputPort(name))
        builder.Connect(
            self.driver.GetOutputPort("desired_state"),
            self.plant.get_desired_state_input_port(self.arm.model),
        )
        self.diagram: Diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.context: Context = self.simulator.get_mutable_context()
        self.at_driver = self.driver.GetMyMutableContextFromRoot(self.context)
        self.at_plant = self.plant.GetMyMutableContextFromRoot(self.context)
        self.plant.get_desired_state_input_port(other).FixValue(
            self.at_plant, np.concatenate([HOME, STILL])
        )
        self.command(HOME, STILL)
        self.pull([0.0, 0.0, 0.0])

    def command(self, position: np.ndarray, velocity: np.ndarray) -> None:
        for name, value in (("position", position), ("velocity", velocity)):
            if self.driver.HasInputPort(name):
                self.driver.GetInputPort(name).FixValue(self.at_driver, value)

    def pull(self, force: npt.ArrayLike) -> None:
        applied = ExternallyAppliedSpatialForce()
        applied.body_index = self.arm.tool
        applied.p_BoBq_B = np.zeros(3)
        applied.F_Bq_W = SpatialForce(tau=np.zeros(3), f=np.array(force))
        self.plant.get_applied_spatial_force_input_port().FixValue(self.at_plant, [applied])

    def read(self, name: str) -> np.ndarray:
        return self.driver.GetOutputPort(name).Eval(self.at_driver)


def test_its_ports_are_those_of_drake_s_panda_messages() -> None:
    driver = SimPandaDriver(HOME, LIMITS, H)
    reported = PandaStatusSender()
    for i in range(reported.num_input_ports()):
        port = reported.get_input_port(i)
        assert driver.GetOutputPort(port.get_name()).size() == port.size()
    received = PandaStatusReceiver()
    for i in range(received.num_output_ports()):
        assert driver.HasOutputPort(received.get_output_port(i).get_name())


@pytest.mark.parametrize("mode", ["position_velocity", "position", "velocity"])
def test_it_follows_in_each_mode(mode: str) -> None:
    rig = Rig(mode)
    rate = np.array([0.3, 0.2, -0.2, 0.2, 0.3, -0.3, 0.3])
    for k in range(200):
        t = k * H
        # motion from rest to rest with speed rate · sin²
        phase = np.pi * t / 0.8
        travelled = rate * (0.5 * t - 0.8 / (4.0 * np.pi) * np.sin(2.0 * phase))
        rig.command(HOME + travelled, rate * np.sin(phase) ** 2)
        rig.simulator.AdvanceTo(t)
    assert rig.read("stop")[0] == Stop.NONE
    rig.command(HOME + 0.4 * rate, STILL)
    rig.simulator.AdvanceTo(1.2)
    np.testing.assert_allclose(rig.read("position_measured"), HOME + 0.4 * rate, atol=3e-3)
    np.testing.assert_allclose(rig.read("velocity_measured"), 0.0, atol=1e-3)


def test_it_feels_what_pulls_at_the_tool_at_rest_and_in_motion() -> None:
    rig = Rig()
    rate = np.array([0.4, 0.1, -0.2, 0.2, 0.3, -0.3, 0.3])
    rig.simulator.AdvanceTo(0.1)
    np.testing.assert_allclose(rig.read("torque_external"), 0.0, atol=1e-3)
    force = np.array([5.0, -8.0, 3.0])
    rig.pull(force)
    found = []
    for k in range(1, 200):
        t = k * H
        rig.command(HOME + rate * (1.0 - np.cos(t)), rate * np.sin(t))
        rig.simulator.AdvanceTo(0.1 + t)
        arm, q = rig.arm.arm, rig.read("position_measured")
        moves = arm.tool_jacobian(arm.links(q))[:3]
        found.append(tool_force(moves, rig.read("torque_external")))
    late = np.array(found[25:])
    assert np.linalg.norm(late - force, axis=1).max() < 0.05 * np.linalg.norm(force)


def test_it_brakes_by_itself_when_commands_end() -> None:
    rig = Rig()
    rate = np.full(7, 0.4)
    for k in range(1, 51):
        t = k * H
        rig.command(HOME + rate * (t - np.sin(10.0 * t) / 10.0) / 2.0, rate * 0.0)
        rig.simulator.AdvanceTo(t)
    rig.driver.GetInputPort("fresh").FixValue(rig.at_driver, [0.0])
    rig.simulator.AdvanceTo(0.5)
    assert rig.read("stop")[0] == Stop.ENDED
    held = rig.read("position_measured").copy()
    rig.simulator.AdvanceTo(0.7)
    np.testing.assert_allclose(rig.read("position_measured"), held, atol=1e-4)
    assert (np.abs(rig.read("torque_measured")) <= LIMITS.torque).all()
