"""The person in a MultibodyPlant: kinematics, rest, compliance and limits of the arms."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydrake.geometry import Role
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ExternallyAppliedSpatialForce,
    MultibodyPlant,
)
from pydrake.multibody.tree import BodyIndex, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_dress.diagrams.person import (
    Person,
    add_person,
    joint_positions,
    person_arms,
)
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.body import (
    ArmMeasures,
    ArmPose,
    BodyMeasures,
    Posture,
    arm_points,
    shoulder_height,
)
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.human.measures import FOREARM_MASS
from drake_dress.models.round_cone import solid
from drake_dress.models.sides import SIDES, Side

M = BodyMeasures()
JOINTS = JointParameters(2.0, 1.0, 1.5, 0.4)
OPEN: dict[Side, ArmPose] = {
    "left": ArmPose(np.deg2rad(45.0), np.deg2rad(25.0), 0.1, np.deg2rad(20.0)),
    "right": ArmPose(np.deg2rad(35.0), np.deg2rad(30.0), -0.2, np.deg2rad(10.0)),
}
POSTURES: tuple[Posture, Posture] = ("standing", "sitting")
JOINT_NAMES = ("abduction", "extension", "rotation", "elbow")


def make(
    posture: Posture = "standing",
    arms: dict[Side, ArmPose] = OPEN,
    joints: JointParameters = JOINTS,
    position: FloatArray | None = None,
    measures: BodyMeasures = M,
) -> tuple[MultibodyPlant, Person]:
    plant = MultibodyPlant(0.002)
    person = add_person(plant, measures, posture, arms, joints, position)
    plant.Finalize()
    return plant, person


def simulate(
    plant: MultibodyPlant, person: Person, duration: float, forces: dict[int, FloatArray]
) -> FloatArray:
    """Returns the joints (6,3), m, after `duration` s; forces (3,), N, act at joint rows."""
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    plant.get_applied_generalized_force_input_port().FixValue(context, person.tone_torque(plant))
    applied = []
    for row, force in forces.items():
        body, point = person.joint_points[row]
        one = ExternallyAppliedSpatialForce()
        one.body_index, one.p_BoBq_B = BodyIndex(body), point
        one.F_Bq_W = SpatialForce(np.zeros(3), force)
        applied.append(one)
    plant.get_applied_spatial_force_input_port().FixValue(context, applied)
    simulator.AdvanceTo(duration)
    return joint_positions(plant, context, person)


def numpy_points(posture: Posture, arms: dict[Side, ArmPose]) -> FloatArray:
    return np.vstack([arm_points(M, posture, side, arms[side]) for side in SIDES])


@pytest.mark.parametrize("posture", POSTURES)
def test_default_context_is_the_rest_pose(posture: Posture) -> None:
    plant, person = make(posture, position=np.array([0.4, -0.3]))
    points = joint_positions(plant, plant.CreateDefaultContext(), person)
    expected = numpy_points(posture, OPEN) + [0.4, -0.3, 0.0]
    np.testing.assert_allclose(points, expected, atol=1e-12)


@pytest.mark.parametrize("posture", POSTURES)
def test_kinematics_of_the_plant_are_those_of_the_model(posture: Posture) -> None:
    plant, person = make(posture)
    context = plant.CreateDefaultContext()
    rng = np.random.default_rng(0)
    for _ in range(20):
        angles = {side: rng.uniform(-2.0, 2.0, 4) for side in SIDES}
        for side in SIDES:
            for name, angle in zip(JOINT_NAMES, angles[side], strict=True):
                joint = plant.GetJointByName(f"{side}_{name}", person.model)
                joint.set_angle(context, angle)
        poses: dict[Side, ArmPose] = {side: ArmPose(*angles[side]) for side in SIDES}
        np.testing.assert_allclose(
            joint_positions(plant, context, person), numpy_points(posture, poses), atol=1e-12
        )


@pytest.mark.parametrize("posture", POSTURES)
def test_rest_pose_stays_put_under_gravity(posture: Posture) -> None:
    plant, person = make(posture)
    drift = simulate(plant, person, 1.0, {}) - numpy_points(posture, OPEN)
    assert np.max(np.linalg.norm(drift, axis=1)) < 1e-3


def test_without_tone_the_arms_sag() -> None:
    plant, person = make()
    simulator = Simulator(plant)
    simulator.AdvanceTo(1.0)
    sag = joint_positions(plant, simulator.get_context(), person) - numpy_points("standing", OPEN)
    assert sag[2, 2] < -0.03


def balanced_hand(
    plant: MultibodyPlant, person: Person, force: FloatArray, newton_steps: int
) -> FloatArray:
    """Returns the left hand (3,), m, where springs, tone, gravity and force are in balance.

    One Newton step from rest is the linear prediction Δq = (K − ∂g/∂q)⁻¹ Jᵀf.
    """
    context = plant.CreateDefaultContext()
    rest = plant.GetPositions(context)
    spring = np.zeros(len(rest))
    for side in SIDES:
        for name in JOINT_NAMES:
            i = plant.GetJointByName(f"{side}_{name}", person.model).position_start()
            spring[i] = JOINTS.elbow_stiffness if name == "elbow" else JOINTS.shoulder_stiffness
    tone, eps = person.tone_torque(plant), 1e-5

    def hand(q: FloatArray) -> FloatArray:
        plant.SetPositions(context, q)
        return joint_positions(plant, context, person)[2]

    def residual(q: FloatArray) -> FloatArray:
        work = [force @ (hand(q + eps * e) - hand(q - eps * e)) / (2 * eps) for e in np.eye(len(q))]
        plant.SetPositions(context, q)
        gravity: FloatArray = plant.CalcGravityGeneralizedForces(context)
        return np.array(work) + gravity + tone - spring * (q - rest)

    q = rest.copy()
    for _ in range(newton_steps):
        slope = [
            (residual(q + eps * e) - residual(q - eps * e)) / (2 * eps) for e in np.eye(len(q))
        ]
        q = q - np.linalg.solve(np.array(slope).T, residual(q))
    return hand(q)


@pytest.mark.parametrize("direction", [(0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (-1.0, 0.0, 0.0)])
def test_hand_yields_to_a_sideways_force_as_the_stiffness_predicts(
    direction: tuple[float, float, float],
) -> None:
    plant, person = make()
    force, rest = 2.0 * np.array(direction), numpy_points("standing", OPEN)[2]
    moved = simulate(plant, person, 8.0, {2: force})[2] - rest
    predicted = balanced_hand(plant, person, force, newton_steps=1) - rest
    assert np.linalg.norm(predicted) > 0.02
    assert np.linalg.norm(moved - predicted) < 0.2 * np.linalg.norm(predicted)


@pytest.mark.parametrize("direction", [(0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.6, 0.0, 0.8)])
def test_hand_comes_to_rest_where_all_torques_balance(
    direction: tuple[float, float, float],
) -> None:
    plant, person = make()
    force, rest = 2.0 * np.array(direction), numpy_points("standing", OPEN)[2]
    moved = simulate(plant, person, 15.0, {2: force})[2] - rest
    balanced = balanced_hand(plant, person, force, newton_steps=12) - rest
    assert np.linalg.norm(moved - balanced) < 0.02 * np.linalg.norm(balanced)


@pytest.mark.parametrize(
    "direction", [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)]
)
def test_limits_hold_under_a_strong_pull(direction: tuple[float, float, float]) -> None:
    plant, person = make()
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    plant.get_applied_generalized_force_input_port().FixValue(context, person.tone_torque(plant))
    one = ExternallyAppliedSpatialForce()
    one.body_index, one.p_BoBq_B = BodyIndex(person.joint_points[2][0]), person.joint_points[2][1]
    one.F_Bq_W = SpatialForce(np.zeros(3), 30.0 * np.array(direction))
    plant.get_applied_spatial_force_input_port().FixValue(context, [one])
    worst = 0.0
    q_low, q_high = plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()
    for time in np.linspace(0.05, 2.0, 40):
        simulator.AdvanceTo(time)
        q = plant.GetPositions(context)
        worst = max(worst, float(np.max(np.maximum(q_low - q, q - q_high))))
    assert worst < np.deg2rad(1.0)


def test_both_arms_yield_alike() -> None:
    same: dict[Side, ArmPose] = {"left": OPEN["left"], "right": OPEN["left"]}
    plant, person = make(arms=same)
    pull = np.array([1.0, 2.0, -1.0])
    mirror = np.array([1.0, -1.0, 1.0])
    points = simulate(plant, person, 1.0, {2: pull, 5: mirror * pull})
    np.testing.assert_allclose(points[3:], points[:3] * mirror, atol=1e-9)


def test_stiffer_joints_yield_less() -> None:
    moved = []
    for stiffness in (2.0, 8.0):
        joints = JointParameters(shoulder_stiffness=stiffness, elbow_stiffness=stiffness)
        plant, person = make(joints=joints)
        shift = simulate(plant, person, 3.0, {2: np.array([0.0, 2.0, 0.0])})
        moved.append(np.linalg.norm(shift[2] - numpy_points("standing", OPEN)[2]))
    assert moved[1] < moved[0]


def test_tone_acts_on_the_person_alone() -> None:
    plant = MultibodyPlant(0.002)
    person = add_person(plant, M, "standing", OPEN, JOINTS)
    other = plant.AddRigidBody(
        "free", plant.AddModelInstance("other"), SpatialInertia.SolidSphereWithMass(1.0, 0.1)
    )
    plant.Finalize()
    torque = person.tone_torque(plant)
    start = other.floating_velocities_start_in_v()
    np.testing.assert_array_equal(torque[start : start + 6], 0.0)
    assert np.max(np.abs(torque)) > 1.0


def test_each_capsule_is_drawn_on_its_body() -> None:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.002)
    person = add_person(plant, M, "sitting", OPEN, JOINTS)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    drawn = inspector.NumGeometriesWithRole(Role.kIllustration)
    assert drawn == len(person.capsules)
    for name, index in person.body_indices.items():
        frame = plant.GetBodyFrameIdOrThrow(index)
        expected = [c for c in person.capsules if c.body == name]
        assert inspector.NumGeometriesForFrameWithRole(frame, Role.kIllustration) == len(expected)


def test_torso_is_fixed_where_it_was_put() -> None:
    plant, person = make(position=np.array([1.0, 2.0]))
    body = plant.get_body(person.body_indices["torso"])
    pose = plant.EvalBodyPoseInWorld(plant.CreateDefaultContext(), body)
    assert pose.IsNearlyEqualTo(RigidTransform([1.0, 2.0, 0.0]), 1e-12)
    assert plant.num_positions() == 8


def test_limb_radii_and_masses_are_those_measured() -> None:
    plant, person = make()
    limb = [M.upper_arm_radius, M.forearm_radius, M.hand_radius]
    np.testing.assert_allclose(person.radius, limb * 2)
    context = plant.CreateDefaultContext()
    for side in SIDES:
        body = plant.get_body(person.body_indices[f"{side}_forearm"])
        assert body.get_mass(context) == FOREARM_MASS
        center = body.CalcCenterOfMassInBodyFrame(context)
        np.testing.assert_allclose(center, [0.0, 0.0, -0.5 * M.forearm_length], atol=1e-12)


def test_tapered_arms_have_the_mass_properties_of_round_cones() -> None:
    body = replace(
        M, elbow_radius=0.035, wrist_radius=0.025, left=ArmMeasures(upper_arm_length=0.2)
    )
    plant, person = make(measures=body)
    context = plant.CreateDefaultContext()
    for side in SIDES:
        own = body.of(side)
        for name, length, radii, mass in (
            ("upper_arm", own.upper_arm_length, own.upper_arm_radii, own.arm_masses[0]),
            ("forearm", own.forearm_length, own.forearm_radii, own.arm_masses[1]),
        ):
            limb = plant.get_body(person.body_indices[f"{side}_{name}"])
            assert limb.get_mass(context) == mass
            center = limb.CalcCenterOfMassInBodyFrame(context)
            expected = solid(length, radii)
            np.testing.assert_allclose(center, [0.0, 0.0, -expected.center], atol=1e-12)
            inertia = limb.CalcSpatialInertiaInBodyFrame(context).Shift(center)
            moments = inertia.CalcRotationalInertia().get_moments() / mass
            across, about = expected.across, expected.about_axis
            np.testing.assert_allclose(moments, [across, across, about], rtol=1e-9)
    np.testing.assert_array_equal(person.radius, [0.045, 0.038, 0.04] * 2)
    # the tone holds the arms where they are
    model = person_arms(body, "standing", OPEN, JOINTS)
    torque = person.tone_torque(plant)[person.arm_dofs(plant)].reshape(2, 4)
    for arm, rest, found in zip(model.arms, model.rest, torque, strict=True):
        # bodies between the hinges of a shoulder weigh, too, but have no lever
        np.testing.assert_allclose(found, -arm.gravity_torque(rest), atol=1e-9)


def test_a_pose_past_a_limit_is_kept_as_the_person_holds_it() -> None:
    past = replace(OPEN["left"], elbow_flexion=-0.05)
    plant, person = make(arms={"left": past, "right": OPEN["right"]})
    points = joint_positions(plant, plant.CreateDefaultContext(), person)
    np.testing.assert_allclose(points[:3], arm_points(M, "standing", "left", past), atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"shoulder_stiffness": -1.0}, "person.joints: shoulder_stiffness: is -1.0"),
        ({"elbow_damping": float("nan")}, "person.joints: elbow_damping: is nan"),
        ({"elbow_limits": (1.0, 0.5)}, "person.joints: elbow_limits: is .*, expected lower"),
        ({"rotation_limits": (0.0,)}, "person.joints: rotation_limits: is .*, expected two"),
    ],
)
def test_unusable_joint_parameters_are_told(change: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        JointParameters(**change)


def test_unusable_position_and_missing_arm_are_told() -> None:
    with pytest.raises(UserError, match=r"person: position: has shape \(3,\), expected \(2,\)"):
        make(position=np.zeros(3))
    with pytest.raises(UserError, match="person: arms: lacks right"):
        make(arms={"left": ArmPose()})
    assert shoulder_height(M, "standing") == M.shoulder_height
