"""Arms that are pulled against the body stop at it."""

import numpy as np
import pytest
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ExternallyAppliedSpatialForce
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_dress.diagrams.person import add_person, joint_positions
from drake_dress.models.arm.clearance import Capsules, clearance
from drake_dress.models.human.body import (
    ArmPose,
    BodyMeasures,
    Posture,
    body_capsules,
    capsule_arrays,
)
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.human.wheelchair import Wheelchair, chair_capsules
from drake_dress.models.sides import Side

M = BodyMeasures()
OPEN: dict[Side, ArmPose] = {
    "left": ArmPose(np.deg2rad(25.0), np.deg2rad(20.0), 0.0, np.deg2rad(15.0)),
    "right": ArmPose(np.deg2rad(35.0), np.deg2rad(30.0), -0.2, np.deg2rad(10.0)),
}
HANGING: dict[Side, ArmPose] = {"left": ArmPose(), "right": ArmPose()}
TRUNK = 3  # capsules of the chest come first


def drawn(
    posture: Posture,
    arms: dict[Side, ArmPose],
    forces: dict[int, list[float]],
    duration: float,
    body: BodyMeasures | None = None,
    chair: Wheelchair | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns joints (6,3), m, before and after `forces` (3,), N, acted on some of them."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.004)
    joints = JointParameters(2.0, 1.0, 1.5, 0.4)
    person = add_person(plant, body or M, posture, arms, joints, chair=chair)
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    before = joint_positions(plant, context, person)
    plant.get_applied_generalized_force_input_port().FixValue(context, person.tone_torque(plant))
    applied = []
    for row, force in forces.items():
        one = ExternallyAppliedSpatialForce()
        one.body_index, one.p_BoBq_B = (
            BodyIndex(person.joint_points[row][0]),
            person.joint_points[row][1],
        )
        one.F_Bq_W = SpatialForce(np.zeros(3), np.array(force))
        applied.append(one)
    plant.get_applied_spatial_force_input_port().FixValue(context, applied)
    simulator.AdvanceTo(duration)
    return before, joint_positions(plant, context, person)


def into_chest(joints: np.ndarray, capsules: Capsules) -> float:
    """Returns the depth, m, by which arms of `joints` (6,3) penetrate the chest."""
    first, second = joints[[0, 1, 3, 4]], joints[[1, 2, 4, 5]]
    radius = np.array([M.upper_arm_radius, M.forearm_radius] * 2)
    pairs = np.array([[i, j] for i in range(4) for j in range(len(capsules.radius))])
    found = clearance(Capsules(first, second, radius), capsules, pairs)
    return -float(found.distance.min())


def chest(posture: Posture) -> Capsules:
    parts = body_capsules(M, posture)[:TRUNK]
    return Capsules(
        np.stack([c.a_B for c in parts]),
        np.stack([c.b_B for c in parts]),
        np.array([c.radius for c in parts]),
    )


@pytest.mark.parametrize("posture", ["standing", "sitting"])
@pytest.mark.parametrize("side", [0, 1])
def test_an_arm_that_is_drawn_inward_stops_at_the_chest(posture: Posture, side: int) -> None:
    inward = 1.0 if side else -1.0
    _, free = drawn(posture, OPEN, {}, 0.1)
    assert into_chest(free, chest(posture)) < 0.0
    _, joints = drawn(posture, OPEN, {3 * side + 1: [0.0, 20.0 * inward, 0.0]}, 2.0)
    # it touches, and sinks into the flesh under 20 N and the springs
    assert -0.002 < into_chest(joints, chest(posture)) < 0.01


def into_chair(joints: np.ndarray) -> float:
    """Returns the depth, m, by which arms of `joints` (6,3) enter a wheelchair."""
    first, second = joints[[0, 1, 3, 4]], joints[[1, 2, 4, 5]]
    radius = np.array([M.upper_arm_radius, M.forearm_radius] * 2)
    chair = Capsules(*capsule_arrays(chair_capsules(Wheelchair(), M)))
    pairs = np.array([[i, j] for i in range(4) for j in range(len(chair.radius))])
    return -float(clearance(Capsules(first, second, radius), chair, pairs).distance.min())


@pytest.mark.parametrize("side", [0, 1])
def test_an_arm_that_is_drawn_downward_stops_at_the_armrest(side: int) -> None:
    chair = Wheelchair()
    # the upper arms lead forward and outward, the forearms lie above the armrests
    pose = ArmPose(np.deg2rad(20.0), np.deg2rad(-25.0), 0.0, np.deg2rad(75.0))
    above: dict[Side, ArmPose] = {"left": pose, "right": pose}
    _, free = drawn("sitting", above, {}, 0.1, chair=chair)
    assert into_chair(free) < -0.01
    inward = 1.0 if side else -1.0
    force = {3 * side + 2: [0.0, 12.0 * inward, -20.0]}
    _, through = drawn("sitting", above, force, 2.0)
    assert into_chair(through) > 0.02
    _, joints = drawn("sitting", above, force, 2.0, chair=chair)
    # the sleeve between both takes 12 mm
    assert -0.014 < into_chair(joints) < -0.002


@pytest.mark.parametrize("side", [0, 1])
def test_a_tapered_arm_stops_at_a_tapered_trunk(side: int) -> None:
    body = BodyMeasures(
        elbow_radius=0.036,
        wrist_radius=0.026,
        waist_width=0.27,
        waist_depth=0.18,
        hip_width=0.34,
        hip_depth=0.21,
    )
    inward = 1.0 if side else -1.0
    trunk = Capsules(*capsule_arrays(body_capsules(body, "standing")[:9]))

    def depth(joints: np.ndarray) -> float:
        first, second = joints[[0, 1, 3, 4]], joints[[1, 2, 4, 5]]
        arms = Capsules(first, second, np.array([body.upper_arm_radii, body.forearm_radii] * 2))
        pairs = np.array([[i, j] for i in range(4) for j in range(9)])
        return -float(clearance(arms, trunk, pairs).distance.min())

    _, free = drawn("standing", OPEN, {}, 0.1, body)
    assert depth(free) < 0.0
    _, joints = drawn("standing", OPEN, {3 * side + 1: [0.0, 20.0 * inward, 0.0]}, 2.0, body)
    assert -0.002 < depth(joints) < 0.01


def test_hands_do_not_go_through_each_other() -> None:
    forward = {2: [15.0, -25.0, 0.0], 5: [15.0, 25.0, 0.0]}
    _, joints = drawn("standing", OPEN, forward, 3.0)
    both = Capsules(joints[[1, 4]], joints[[2, 5]], np.full(2, M.forearm_radius))
    apart = clearance(both, both, np.array([[0, 1]])).distance[0]
    assert apart > -0.01


@pytest.mark.parametrize("posture", ["standing", "sitting"])
@pytest.mark.parametrize("arms", [OPEN, HANGING])
def test_the_rest_pose_stays_one(posture: Posture, arms: dict[Side, ArmPose]) -> None:
    before, after = drawn(posture, arms, {}, 1.0)
    assert np.abs(after - before).max() < 1e-3
