"""The station: where robots, person and garment are. Simulated here; hardware has the same ports.

    inputs   {left,right}_gripper.position_command   (3,) p_WG, m
             or, with arms, {left,right}_arm.position_command (7,) rad, velocity_command rad/s
    outputs  {left,right}_arm.position_measured (7,) rad, velocity_measured rad/s, with arms
             {left,right}_gripper.position_measured  (3,) m
             {left,right}_gripper.velocity_measured  (3,) m/s
             {left,right}_gripper.force_measured     (3,) of the garment on the gripper, N
             cheat_garment_position, cheat_garment_velocity   (3n,)
             cheat_contact (n,), cheat_contact_force (3n,)
             cheat_body_poses                        of the person's bodies

What only simulation can know has the prefix `cheat_`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer, SceneGraph
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ExternallyAppliedSpatialForceMultiplexer,
    MultibodyPlant,
)
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort
from pydrake.systems.primitives import Demultiplexer, Multiplexer

from drake_dress.diagrams.arms import ArmPlacement, ArmSetup, PlantArm, add_arms, set_up_arms
from drake_dress.diagrams.behaviour import Behaviour, add_behaviour
from drake_dress.diagrams.person import JointParameters, Person, add_person, person_arms
from drake_dress.models.arm.clearance import Capsules
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.implicit import ClothState
from drake_dress.models.cloth.layered import Integrator, LayeredCloth
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.scheme import MakeIntegrator, Scheme
from drake_dress.models.control.person_model import PersonModel, person_capsules
from drake_dress.models.effects.composition import (
    GarmentWithEffects,
    body_with_effects,
    true_times,
)
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.grip import GripperLatency
from drake_dress.models.effects.mounts import Mounts
from drake_dress.models.garment.grain import grain
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.body import (
    ArmPose,
    BodyMeasures,
    Posture,
    arm_points,
    shoulder_height,
    shoulder_joint,
)
from drake_dress.models.sides import SIDES, Side
from drake_dress.systems.cloth_plant import ClothPlant
from drake_dress.systems.delay import delayed
from drake_dress.systems.floating_gripper import FloatingGripper
from drake_dress.systems.tool_load import ToolLoad
from drake_dress.systems.tool_motion import ToolMotion

FloatArray = np.ndarray
_MOTION = ("position", "velocity")
# Time for which the coat hangs from still grippers before the run begins, and its damping then, s.
_SETTLING_TIME = 1.6
_SETTLING_DAMPING = 0.03


@dataclass(frozen=True)
class StationParameters:
    """What the simulated station is made of; SI units."""

    mesh: GarmentMesh
    material: Material
    time_step: float
    measures: BodyMeasures
    posture: Posture
    arms: dict[Side, ArmPose]
    joints: JointParameters
    behaviour: Behaviour = field(default_factory=Behaviour)
    gripper_max_speed: float = 0.25
    gripper_max_acceleration: float = 2.0
    distance_behind: float = 0.45
    height_offset: float = 0.0
    lateral_offset: float = 0.0
    integrator: str = "implicit"
    iterations: int = 40
    tolerance: float = 5e-3
    self_collision: bool = False
    effects: tuple[Effect, ...] = ()
    placement: ArmPlacement | None = None


@dataclass(frozen=True)
class Station:
    """A station's diagram, and what its users need of what is inside."""

    diagram: Diagram
    plant: MultibodyPlant
    scene_graph: SceneGraph
    person: Person
    cloth: ClothPlant
    start_grippers: FloatArray
    robots: ArmSetup | None = None


def make_simulated_station(p: StationParameters, meshcat: Meshcat | None = None) -> Station:
    """Returns a station whose grippers, on arms or floating, hold a coat behind a person.

    Raises:
        ArmReachError: the arms do not reach where the grippers are at first.
    """
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, p.time_step)
    body = body_with_effects(p.measures, p.effects)
    person = add_person(plant, body, p.posture, p.arms, p.joints, turns=p.behaviour.turns)
    robots = None
    if p.placement is not None:
        robots = set_up_arms(p.placement, start_grippers(p), person_at_rest(p, body, person))
        arms = add_arms(plant, {side: p.placement.base(side) for side in SIDES})
    plant.Finalize()

    held = np.concatenate([p.mesh.grasp[side] for side in SIDES]).astype(np.int32)
    hung, grippers = hung_garment(p), start_grippers(p)
    start = settled(p, hung, held)

    cloth = builder.AddNamedSystem(
        "cloth",
        ClothPlant(
            _integrator(p, held),
            (len(p.mesh.grasp["left"]), len(p.mesh.grasp["right"])),
            start,
            grippers,
            person.capsules,
            person.body_indices,
            Mounts(p.effects),
        ),
    )
    builder.Connect(plant.get_body_poses_output_port(), cloth.GetInputPort("body_poses"))
    builder.Connect(
        plant.get_body_spatial_velocities_output_port(),
        cloth.GetInputPort("body_spatial_velocities"),
    )
    forces = cloth.GetOutputPort("person_forces")
    motion: dict[tuple[Side, str], OutputPort] = {}
    if robots is None:
        for i, side in enumerate(SIDES):
            gripper = builder.AddNamedSystem(
                f"{side}_gripper",
                FloatingGripper(
                    grippers[i], p.time_step, p.gripper_max_speed, p.gripper_max_acceleration
                ),
            )
            builder.ExportInput(
                gripper.GetInputPort("position_command"), f"{side}_gripper.position_command"
            )
            for quantity in _MOTION:
                motion[side, quantity] = gripper.GetOutputPort(f"{quantity}_measured")
    else:
        motion, load = _wire_arms(builder, plant, cloth, arms, robots)
        both = builder.AddSystem(ExternallyAppliedSpatialForceMultiplexer(2))
        builder.Connect(forces, both.get_input_port(0))
        builder.Connect(load, both.get_input_port(1))
        forces = both.get_output_port()
    builder.Connect(forces, plant.get_applied_spatial_force_input_port())
    add_behaviour(
        builder,
        plant,
        person,
        person_arms(body, p.posture, p.arms, p.joints),
        p.behaviour,
        p.mesh,
        cloth.GetOutputPort("garment_position"),
    )
    # a gripper that were earlier than it reports would have to know the future
    late = -float(true_times(np.zeros(1), p.effects, GripperLatency.NAME)[0])
    for i, side in enumerate(SIDES):
        for quantity in _MOTION:
            port = motion[side, quantity]
            builder.ExportOutput(port, f"{side}_gripper.{quantity}_measured")
            first = grippers[i] if quantity == "position" else np.zeros(3)
            port = delayed(builder, port, first, p.time_step, late)
            builder.Connect(port, cloth.GetInputPort(f"{side}_gripper_{quantity}"))
        builder.ExportOutput(
            cloth.GetOutputPort(f"{side}_gripper_force"), f"{side}_gripper.force_measured"
        )
    for name in ("garment_position", "garment_velocity", "contact", "contact_force"):
        builder.ExportOutput(cloth.GetOutputPort(name), f"cheat_{name}")
    builder.ExportOutput(plant.get_body_poses_output_port(), "cheat_body_poses")
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    diagram.set_name("station")
    return Station(diagram, plant, scene_graph, person, cloth, grippers, robots)


def _wire_arms(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    cloth: ClothPlant,
    arms: dict[Side, PlantArm],
    robots: ArmSetup,
) -> tuple[dict[tuple[Side, str], OutputPort], OutputPort]:
    """Returns the motion of the arms' tools, and the garment's forces on them."""
    for i, side in enumerate(SIDES):
        model = arms[side].model
        plant.SetDefaultPositions(model, robots.start[i])
        asked = builder.AddNamedSystem(f"{side}_arm_command", Multiplexer([7, 7]))
        builder.Connect(asked.get_output_port(), plant.get_desired_state_input_port(model))
        seen = builder.AddNamedSystem(f"{side}_arm_state", Demultiplexer([7, 7]))
        builder.Connect(plant.get_state_output_port(model), seen.get_input_port())
        for k, quantity in enumerate(_MOTION):
            builder.ExportInput(asked.get_input_port(k), f"{side}_arm.{quantity}_command")
            builder.ExportOutput(seen.get_output_port(k), f"{side}_arm.{quantity}_measured")
    tools = [arms[side].tool for side in SIDES]
    tool = builder.AddNamedSystem("tool_motion", ToolMotion(tools))
    load = builder.AddNamedSystem("tool_load", ToolLoad(tools))
    for name in ("body_poses", "body_spatial_velocities"):
        builder.Connect(plant.GetOutputPort(name), tool.GetInputPort(name))
    for side in SIDES:
        builder.Connect(
            cloth.GetOutputPort(f"{side}_gripper_force"), load.GetInputPort(f"{side}_force")
        )
    motion = {(s, q): tool.GetOutputPort(f"{s}_{q}") for s in SIDES for q in _MOTION}
    return motion, load.get_output_port()


def person_at_rest(p: StationParameters, body: BodyMeasures, person: Person) -> Capsules:
    """Returns the person's capsules before anything moves."""
    joints = np.concatenate([arm_points(body, p.posture, side, p.arms[side]) for side in SIDES])
    model = PersonModel(
        capsules=person.capsules,
        shoulders=np.stack([shoulder_joint(body, p.posture, side) for side in SIDES]),
        radius=(body.upper_arm_radius, body.forearm_radius, body.hand_radius),
    )
    return Capsules(*person_capsules(model, joints))


def hung_garment(p: StationParameters) -> FloatArray:
    """Returns the garment's rest shape (n,3) where its grippers are at first, p_WN, m."""
    top = shoulder_height(p.measures, p.posture) + p.height_offset
    return p.mesh.rest_position + np.array([-p.distance_behind, p.lateral_offset, top])


def start_grippers(p: StationParameters) -> FloatArray:
    """Returns where left and right gripper are at first, p_WG (2,3), m."""
    hung = hung_garment(p)
    return np.stack([hung[p.mesh.grasp[side]].mean(axis=0) for side in SIDES])


def _integrator(p: StationParameters, held: np.ndarray) -> Integrator:
    """Returns what steps the plant's garment."""
    scheme = Scheme(
        held,
        p.time_step,
        p.integrator == "projective_dynamics",
        p.tolerance,
        p.iterations,
    )
    integrator = _with_effects(p, scheme)
    return LayeredCloth(integrator) if p.self_collision else integrator


def _with_effects(p: StationParameters, make: MakeIntegrator) -> GarmentWithEffects:
    return GarmentWithEffects(
        p.mesh.rest_position, p.mesh.faces, grain(p.mesh), p.material, p.effects, make
    )


def settled(p: StationParameters, hung: FloatArray, held: np.ndarray) -> FloatArray:
    """Returns the garment (n,3), m, after it has hung from still grippers for a while."""
    cloth = _with_effects(p, Scheme(held, p.time_step, damping=_SETTLING_DAMPING))
    state = ClothState.at_rest(hung)
    still = np.zeros((len(held), 3))
    for _ in range(int(_SETTLING_TIME / p.time_step)):
        state, _ = cloth.step(state, Obstacles.none(), still)
    return state.x
