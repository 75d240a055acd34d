"""Pandas in a plant: they agree with the kinematic model, keep the maker's limits and are stiff."""

from dataclasses import dataclass

import numpy as np
import pytest
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder

from drake_dress.diagrams.arms import PlantArm, add_arms
from drake_dress.models.arm.panda import LIMITS
from drake_dress.models.sides import SIDES, Side

HOME = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8])


def base(side: str) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = -0.9, 0.5 if side == "left" else -0.5, 1.0
    return pose


@dataclass
class Lab:
    """Two arms alone in a plant with a time step of 4 ms."""

    plant: MultibodyPlant
    arms: dict[Side, PlantArm]
    simulator: Simulator
    root: Context

    @property
    def context(self) -> Context:
        return self.plant.GetMyMutableContextFromRoot(self.root)

    def ask(self, q: np.ndarray, v: np.ndarray) -> None:
        for arm in self.arms.values():
            port = self.plant.get_desired_state_input_port(arm.model)
            port.FixValue(self.context, np.concatenate([q, v]))


@pytest.fixture
def lab() -> Lab:
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.004)
    arms = add_arms(plant, {side: base(side) for side in SIDES})
    plant.Finalize()
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    made = Lab(plant, arms, Simulator(diagram, root), root)
    for arm in arms.values():
        plant.SetPositions(made.context, arm.model, HOME)
    made.ask(HOME, np.zeros(7))
    return made


@pytest.mark.parametrize("side", SIDES)
def test_links_are_where_the_plain_model_says(lab: Lab, side: Side) -> None:
    rng = np.random.default_rng(0)
    arm = lab.arms[side]
    tool = lab.plant.get_body(arm.tool)
    for _ in range(10):
        q = rng.uniform(LIMITS.lower, LIMITS.upper)
        lab.plant.SetPositions(lab.context, arm.model, q)
        links = arm.arm.links(q)
        pose = lab.plant.EvalBodyPoseInWorld(lab.context, tool).GetAsMatrix4()
        np.testing.assert_allclose(pose, links[-1], atol=1e-12)
        world = lab.plant.world_frame()
        jacobian = lab.plant.CalcJacobianSpatialVelocity(
            lab.context, JacobianWrtVariable.kV, tool.body_frame(), np.zeros(3), world, world
        )
        first = lab.plant.GetJointByName("panda_joint1", arm.model).velocity_start()
        own = jacobian[:, first : first + 7]
        np.testing.assert_allclose(
            arm.arm.tool_jacobian(links), np.vstack([own[3:], own[:3]]), atol=1e-12
        )


def test_limits_are_those_of_the_urdf(lab: Lab) -> None:
    for arm in lab.arms.values():
        for i in range(7):
            joint = lab.plant.GetJointByName(f"panda_joint{i + 1}", arm.model)
            assert joint.position_lower_limits()[0] == pytest.approx(LIMITS.lower[i])
            assert joint.position_upper_limits()[0] == pytest.approx(LIMITS.upper[i])
            assert joint.velocity_upper_limits()[0] == pytest.approx(LIMITS.speed[i])
    for k in lab.plant.GetJointActuatorIndices():
        actuator = lab.plant.get_joint_actuator(k)
        i = int(actuator.name()[-1]) - 1
        assert actuator.effort_limit() == LIMITS.torque[i]


def test_an_arm_holds_itself_and_follows(lab: Lab) -> None:
    lab.simulator.AdvanceTo(0.5)
    arm = lab.arms["left"]
    np.testing.assert_allclose(lab.plant.GetPositions(lab.context, arm.model), HOME, atol=1e-6)
    off = []
    for k in range(500):
        t = 0.5 + 0.004 * k
        way = 0.2 * np.sin(np.pi * (t - 0.5))
        speed = 0.2 * np.pi * np.cos(np.pi * (t - 0.5))
        lab.ask(HOME + way, np.full(7, speed))
        lab.simulator.AdvanceTo(t + 0.004)
        q = lab.plant.GetPositions(lab.context, arm.model)
        ahead = 0.2 * np.sin(np.pi * (t + 0.004 - 0.5))
        off.append(np.linalg.norm(arm.arm.tool_position(q) - arm.arm.tool_position(HOME + ahead)))
    assert np.median(off) < 3e-3


def test_torques_stay_within_limits(lab: Lab) -> None:
    """A jump of half a radian would need far more torque than a drive has."""
    lab.ask(HOME + 0.5, np.zeros(7))
    port = lab.plant.get_net_actuation_output_port()
    most = np.zeros(14)
    for k in range(25):
        lab.simulator.AdvanceTo(0.004 * (k + 1))
        most = np.maximum(most, np.abs(port.Eval(lab.context)))
    limit = np.tile(LIMITS.torque, 2)
    assert (most <= limit * (1.0 + 1e-9)).all()
    assert (most > 0.99 * limit).any()
