"""The station: robots, person and garment. Simulated here; hardware has the same ports.

With arms:

    inputs   {left,right}_arm.position, velocity             (7,) commands, rad, rad/s
    outputs  {left,right}_arm.position_commanded, position_measured, velocity_commanded,
             velocity_measured, acceleration_commanded, torque_commanded, torque_measured,
             torque_external                                 (7,) as in Drake's Panda messages
             {left,right}_arm.stopped                        (1,) > 0: driver ignores commands

Without arms, inputs {left,right}_gripper.position_command, (3,) p_WG, m. Always:

    inputs   release                                         (1,) > 0.5: both grippers are to open
             cue                                             (1,) > 0.5: arms are to be lowered
    outputs  {left,right}_gripper.position_measured          (3,) m
             {left,right}_gripper.velocity_measured          (3,) m/s
             {left,right}_gripper.force_measured             (3,) of the garment on the gripper, N
             estimate.garment_position, garment_velocity     (3m,) of the controller's garment
             estimate.joint_position                         (18,) of the person's arms, m
             NAME.color_image, NAME.depth_image              of each camera
             permission                                      (1,) 0: arms must come to rest
             grippers_open                                   (1,) 1: both have let go
             cheat_garment_position, cheat_garment_velocity  (3n,)
             cheat_contact (n,), cheat_contact_force (3n,)
             cheat_joint_position                            (18,) of the person's arms
             cheat_intent                                    (2,) 1: the person moves that arm
             cheat_{left,right}_arm_stop                     (1,) why a driver ignores commands
    inputs   cheat_{left,right}_arm_fresh                    (1,) 0: its commands have ended
             cheat_push                                      (6,) force on the arms' tools, N
    outputs  NAME.label_image, NAME.image_time               where controllers see with cameras
             cheat_plant_state                               of the MultibodyPlant
             cheat_body_poses                                of the person's bodies

Ports that only a simulation can have carry the prefix `cheat_`. With arms, the measurements of
grippers are derived from the joints; floating grippers are measured directly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import scipy.sparse as sp
from pydrake.geometry import Meshcat, MeshcatVisualizer, SceneGraph
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ExternallyAppliedSpatialForceMultiplexer,
    MultibodyPlant,
)
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, InputPort, OutputPort
from pydrake.systems.primitives import ConstantVectorSource

from drake_dress.diagrams.arms import (
    ArmPlacement,
    ArmSetup,
    PlantArm,
    add_arms,
    check_reach,
    set_up_arms,
)
from drake_dress.diagrams.behaviour import Behaviour, add_behaviour
from drake_dress.diagrams.cameras import Camera, CameraFaults, export_cameras, show_skin
from drake_dress.diagrams.oracles import export_oracles
from drake_dress.diagrams.panda_driver import SimPandaDriver
from drake_dress.diagrams.person import (
    Person,
    add_person,
    person_arms,
    person_model,
)
from drake_dress.models.arm.clearance import Capsules
from drake_dress.models.arm.panda import LIMITS
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitSettings
from drake_dress.models.cloth.layered import Integrator, LayeredCloth
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.mujoco.settings import MujocoSettings
from drake_dress.models.cloth.projective.projective_dynamics import ProjectiveSettings
from drake_dress.models.cloth.releasable import ReleasableCloth
from drake_dress.models.cloth.scheme import MakeIntegrator, Scheme
from drake_dress.models.cloth.state import ClothState
from drake_dress.models.control.person_model import person_capsules
from drake_dress.models.effects.composition import (
    GarmentWithEffects,
    body_with_effects,
    true_times,
)
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.grip import GripperLatency
from drake_dress.models.effects.mounts import Mounts
from drake_dress.models.garment.grain import grain
from drake_dress.models.garment.mesh import GarmentMesh, edge_lengths
from drake_dress.models.human.body import (
    ArmPose,
    BodyMeasures,
    Posture,
    arm_points,
    shoulder_height,
)
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.human.shape import met_by_mesh
from drake_dress.models.human.skin.person_skin import PersonSkin, person_skin
from drake_dress.models.human.skin.phenotype import Phenotype
from drake_dress.models.human.wheelchair import Wheelchair
from drake_dress.models.sides import SIDES, Side
from drake_dress.report.log_writer import RunLogWriter
from drake_dress.systems.arm_measurement import ArmMeasurement
from drake_dress.systems.cloth_plant import ClothPlant
from drake_dress.systems.delay import delayed
from drake_dress.systems.floating_gripper import FloatingGripper
from drake_dress.systems.person_bodies import PersonBodies
from drake_dress.systems.tool_load import ToolLoad
from drake_dress.systems.tool_motion import ToolMotion

# Quantities of motion of a garment, an arm or a gripper, in names of ports.
MOTION = ("position", "velocity")
# Quantities that an arm reports, as named by Drake's PandaStatusSender.
ARM_STATUS = (
    "position_commanded",
    "position_measured",
    "velocity_commanded",
    "velocity_measured",
    "acceleration_commanded",
    "torque_commanded",
    "torque_measured",
    "torque_external",
)
# Time for which the coat hangs from still grippers before the run begins, and its damping then, s.
_SETTLING_TIME = 1.6
_SETTLING_DAMPING = 0.03
# Speed of a node above which the simulation counts as diverged, m/s; a swinging hem reaches 1.7. A
# diverged simulation is at 8 m/s a tenth of a second later, and each further tenth takes minutes.
_BROKEN_SPEED = 5.0


@dataclass(frozen=True, kw_only=True)
class StationParameters:
    """Parameters of the simulated station; SI units.

    `time_step` is the garment's, `body_time_step` that of arms, grippers and the person's joints.
    `phenotype` is that of a parametric body; its skin is seen, and nothing touches it.
    With `in_front` the garment hangs in front of the person, at `distance_behind`.
    `in_worker` steps the garment in a worker process. `camera_faults` act on depth and labels; None
    for perfect images.
    """

    mesh: GarmentMesh
    material: Material
    time_step: float
    body_time_step: float
    measures: BodyMeasures
    posture: Posture
    arms: dict[Side, ArmPose]
    joints: JointParameters
    chair: Wheelchair | None = None
    behaviour: Behaviour = field(default_factory=Behaviour)
    gripper_max_speed: float
    gripper_max_acceleration: float
    in_front: bool = False
    distance_behind: float
    height_offset: float = 0.0
    lateral_offset: float = 0.0
    integrator: str
    iterations: int
    tolerance: float
    implicitness: float
    buckling_wavelength: float
    self_collision: bool
    grasp_stiffness: float
    effects: tuple[Effect, ...] = ()
    placement: ArmPlacement | None = None
    mode: str
    cameras: tuple[Camera, ...] = ()
    camera_faults: CameraFaults | None = None
    phenotype: Phenotype | None = None
    in_worker: bool = False

    def skin(self, drawn_in: bool = True) -> PersonSkin | None:
        """Returns the person's skin, which takes a second; None without `phenotype`."""
        if self.phenotype is None:
            return None
        return person_skin(self.phenotype, self.posture, self.measures, drawn_in)


@dataclass(frozen=True)
class Sight:
    """Parameters of the estimates of garment and person.

    Attributes:
        transfer: (m,n) from the true garment's nodes to the controller's.
        period: of the controllers' commands, to which the estimates' delay is rounded, s.
    """

    transfer: sp.csr_array
    period: float


@dataclass(frozen=True)
class Station:
    """A station's diagram, and the data that its users need.

    Attributes:
        diagram: with the ports above.
        person: as the scenario describes it.
        start_grippers: (2,3) of left and right at time 0, m.
        robots: the arms; None where grippers float.
    """

    diagram: Diagram
    person: Person
    start_grippers: FloatArray
    robots: ArmSetup | None

    @property
    def in_real_time(self) -> bool:
        """Whether the world keeps moving while a controller solves."""
        return False

    def make_ready(self, rehearse: Callable[[FloatArray, FloatArray], None]) -> None:
        """Prepares the station; called once, before a run begins.

        Args:
            rehearse: has all controllers solve once, for a garment (m,3) and joints (6,3), m.
        """

    def fault(self, root: Context) -> str | None:
        """Returns the fault by which the station ends the run; None if there is none."""
        return None

    def note(self, root: Context, writer: RunLogWriter) -> None:
        """Writes the station's own records of a finished run to the log."""


@dataclass(frozen=True)
class SimulatedStation(Station):
    """A simulated station and its main systems."""

    plant: MultibodyPlant
    scene_graph: SceneGraph
    cloth: ClothPlant

    def fault(self, root: Context) -> str | None:
        """Returns a message if a node is so fast that the simulation must have diverged."""
        velocity = self.cloth.GetOutputPort("garment_velocity").Eval(
            self.cloth.GetMyContextFromRoot(root)
        )
        speed = float(np.linalg.norm(velocity.reshape(-1, 3), axis=1).max())
        if speed <= _BROKEN_SPEED:
            return None
        return f"plant: the garment's simulation broke down, a node moves at {speed:.0f} m/s"


def make_simulated_station(
    p: StationParameters, meshcat: Meshcat | None = None, sight: Sight | None = None
) -> SimulatedStation:
    """Returns a station whose grippers, on arms or floating, hold a garment beside a person.

    Args:
        p: its parameters.
        meshcat: page that shows it, if any.
        sight: parameters of the estimates; without it there are no estimates.

    Raises:
        ArmReachError: the arms cannot reach the grippers' start, or later goals of a dressing.
    """
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, p.body_time_step)
    body = body_with_effects(p.measures, p.effects)
    person = _add_person(plant, body, p)
    robots, arms = None, None
    if p.placement is not None:
        robots = robots_at_start(p, p.placement, body, person)
        arms = add_arms(plant, {side: p.placement.base(side) for side in SIDES})
    plant.Finalize()

    grippers = start_grippers(p)
    cloth = _add_cloth(builder, plant, person, grippers, p)
    forces = cloth.GetOutputPort("person_forces")
    if robots is None or arms is None:
        motion = _add_floating_grippers(builder, grippers, p)
        felt = {(s, "force"): cloth.GetOutputPort(f"{s}_gripper_force") for s in SIDES}
        measured = motion | felt
    else:
        measured = _wire_drivers(builder, plant, arms, robots, p)
        motion, load = _wire_tools(builder, plant, cloth, arms)
        forces = _joined(builder, forces, load)
    builder.Connect(forces, plant.get_applied_spatial_force_input_port())
    intent, told = add_behaviour(
        builder,
        plant,
        person,
        person_arms(body, p.posture, p.arms, p.joints),
        p.behaviour,
        p.mesh,
        cloth.GetOutputPort("garment_position"),
        cloth.GetOutputPort("grippers_open"),
    )
    _connect_grippers(builder, cloth, motion, grippers, p)
    _export_measured(builder, measured)
    _export_end(builder, cloth, told)
    if sight is not None:
        points = person.joint_points
        export_oracles(builder, cloth, plant, points, sight.transfer, p.effects, sight.period)
        _export_permission(builder)
    _export_truth(builder, cloth, plant, intent)
    _export_cameras(builder, plant, scene_graph, person, cloth, p)
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    diagram.set_name("station")
    return SimulatedStation(diagram, person, grippers, robots, plant, scene_graph, cloth)


def _add_person(plant: MultibodyPlant, body: BodyMeasures, p: StationParameters) -> Person:
    """Adds the person with the true body."""
    turns = p.behaviour.turns
    return add_person(plant, body, p.posture, p.arms, p.joints, turns=turns, chair=p.chair)


def _export_permission(builder: DiagramBuilder) -> None:
    """Exports the permission to let go, which is always there in a simulation."""
    permission = builder.AddNamedSystem("permission", ConstantVectorSource([1.0]))
    builder.ExportOutput(permission.get_output_port(), "permission")


# Output ports of grippers by side and quantity.
_Ports = dict[tuple[Side, str], OutputPort]


def _add_cloth(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    person: Person,
    grippers: FloatArray,
    p: StationParameters,
) -> ClothPlant:
    """Adds the garment as it hangs at the start, with contact with the person's bodies."""
    spacing = float(edge_lengths(p.mesh.rest_position, p.mesh.faces).mean())
    cloth: ClothPlant = builder.AddNamedSystem(
        "cloth",
        ClothPlant(
            plant_integrator(p),
            (len(p.mesh.grasp["left"]), len(p.mesh.grasp["right"])),
            settled(p, hung_garment(p)),
            grippers,
            PersonBodies(met_by_mesh(person.capsules, spacing), person.body_indices),
            p.grasp_stiffness,
            Mounts(p.effects),
            p.in_worker,
        ),
    )
    for name in ("body_poses", "body_spatial_velocities"):
        builder.Connect(plant.GetOutputPort(name), cloth.GetInputPort(name))
    return cloth


def _add_floating_grippers(
    builder: DiagramBuilder, grippers: FloatArray, p: StationParameters
) -> _Ports:
    """Adds two grippers without arms; returns the ports of their motion."""
    motion = {}
    for i, side in enumerate(SIDES):
        gripper = builder.AddNamedSystem(
            f"{side}_gripper",
            FloatingGripper(
                grippers[i], p.body_time_step, p.gripper_max_speed, p.gripper_max_acceleration
            ),
        )
        builder.ExportInput(
            gripper.GetInputPort("position_command"), f"{side}_gripper.position_command"
        )
        for quantity in MOTION:
            motion[side, quantity] = gripper.GetOutputPort(f"{quantity}_measured")
    return motion


def _connect_grippers(
    builder: DiagramBuilder,
    cloth: ClothPlant,
    motion: _Ports,
    grippers: FloatArray,
    p: StationParameters,
) -> None:
    """Makes the garment follow the grippers, with the latency of the effects."""
    # a negative latency has no effect, because it would need future positions
    late = -float(true_times(np.zeros(1), p.effects, GripperLatency.NAME)[0])
    for i, side in enumerate(SIDES):
        for quantity in MOTION:
            first = grippers[i] if quantity == "position" else np.zeros(3)
            port = delayed(builder, motion[side, quantity], first, p.body_time_step, late)
            builder.Connect(port, cloth.GetInputPort(f"{side}_gripper_{quantity}"))


def _export_measured(builder: DiagramBuilder, measured: _Ports) -> None:
    for (side, quantity), port in measured.items():
        builder.ExportOutput(port, f"{side}_gripper.{quantity}_measured")


def _export_end(builder: DiagramBuilder, cloth: ClothPlant, told: InputPort | None) -> None:
    """Exports the ports that are used once both sleeves are on."""
    builder.ExportInput(cloth.GetInputPort("release"), "release")
    builder.ExportOutput(cloth.GetOutputPort("grippers_open"), "grippers_open")
    if told is not None:
        builder.ExportInput(told, "cue")


def _export_truth(
    builder: DiagramBuilder, cloth: ClothPlant, plant: MultibodyPlant, intent: OutputPort
) -> None:
    for name in ("garment_position", "garment_velocity", "contact", "contact_force"):
        builder.ExportOutput(cloth.GetOutputPort(name), f"cheat_{name}")
    builder.ExportOutput(plant.get_body_poses_output_port(), "cheat_body_poses")
    builder.ExportOutput(plant.get_state_output_port(), "cheat_plant_state")
    builder.ExportOutput(intent, "cheat_intent")


def _export_cameras(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    person: Person,
    cloth: ClothPlant,
    p: StationParameters,
) -> None:
    """Exports the cameras' images of the garment and the person, with its skin if it has one."""
    skin = p.skin() if p.cameras else None
    if skin is not None:
        show_skin(builder, plant, scene_graph, person, skin)
    seen = cloth.GetOutputPort("garment_position")
    export_cameras(builder, scene_graph, p.mesh, seen, p.cameras, p.camera_faults)


def _wire_drivers(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    arms: dict[Side, PlantArm],
    robots: ArmSetup,
    p: StationParameters,
) -> dict[tuple[Side, str], OutputPort]:
    """Adds the arms' drivers and exports their ports; returns the grippers' measurements."""
    measure = builder.AddNamedSystem("arm_measurement", ArmMeasurement(robots.pair.arms))
    for i, side in enumerate(SIDES):
        model = arms[side].model
        plant.SetDefaultPositions(model, robots.start[i])
        driver = builder.AddNamedSystem(
            f"{side}_arm_driver", SimPandaDriver(robots.start[i], LIMITS, p.body_time_step, p.mode)
        )
        builder.Connect(plant.get_state_output_port(model), driver.GetInputPort("state"))
        builder.Connect(
            plant.get_net_actuation_output_port(model), driver.GetInputPort("actuation")
        )
        builder.Connect(
            driver.GetOutputPort("desired_state"), plant.get_desired_state_input_port(model)
        )
        for quantity in MOTION:
            if quantity in p.mode:
                builder.ExportInput(driver.GetInputPort(quantity), f"{side}_arm.{quantity}")
        builder.ExportInput(driver.GetInputPort("fresh"), f"cheat_{side}_arm_fresh")
        for name in (f"{side}_arm.stopped", f"cheat_{side}_arm_stop"):
            builder.ExportOutput(driver.GetOutputPort("stop"), name)
        for name in ARM_STATUS:
            builder.ExportOutput(driver.GetOutputPort(name), f"{side}_arm.{name}")
        for name, port in (
            ("position", "position_measured"),
            ("velocity", "velocity_measured"),
            ("torque_external", "torque_external"),
        ):
            builder.Connect(driver.GetOutputPort(port), measure.GetInputPort(f"{side}_{name}"))
    return {
        (side, quantity): measure.GetOutputPort(f"{side}_gripper_{quantity}")
        for side in SIDES
        for quantity in (*MOTION, "force")
    }


def _wire_tools(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    cloth: ClothPlant,
    arms: dict[Side, PlantArm],
) -> tuple[dict[tuple[Side, str], OutputPort], OutputPort]:
    """Returns the true motion of the arms' tools, and the spatial forces on them."""
    tools = [arms[side].tool for side in SIDES]
    tool = builder.AddNamedSystem("tool_motion", ToolMotion(tools))
    load = builder.AddNamedSystem("tool_load", ToolLoad(tools))
    builder.ExportInput(load.GetInputPort("push"), "cheat_push")
    for name in ("body_poses", "body_spatial_velocities"):
        builder.Connect(plant.GetOutputPort(name), tool.GetInputPort(name))
    for side in SIDES:
        builder.Connect(
            cloth.GetOutputPort(f"{side}_gripper_force"), load.GetInputPort(f"{side}_force")
        )
    motion = {(s, q): tool.GetOutputPort(f"{s}_{q}") for s in SIDES for q in MOTION}
    return motion, load.get_output_port()


def _joined(builder: DiagramBuilder, first: OutputPort, second: OutputPort) -> OutputPort:
    """Returns a port that joins two lists of spatial forces."""
    both = builder.AddSystem(ExternallyAppliedSpatialForceMultiplexer(2))
    builder.Connect(first, both.get_input_port(0))
    builder.Connect(second, both.get_input_port(1))
    return both.get_output_port()


def person_at_rest(p: StationParameters, body: BodyMeasures, person: Person) -> Capsules:
    """Returns the person's capsules at the start."""
    joints = np.concatenate([arm_points(body, p.posture, side, p.arms[side]) for side in SIDES])
    return Capsules(*person_capsules(person_model(body, p.posture, person), joints))


def hung_garment(p: StationParameters) -> FloatArray:
    """Returns the garment's rest shape (n,3) at its place at the start, p_WN, m."""
    top = shoulder_height(p.measures, p.posture) + p.height_offset
    ahead = p.distance_behind if p.in_front else -p.distance_behind
    return p.mesh.rest_position + np.array([ahead, p.lateral_offset, top])


def start_grippers(p: StationParameters) -> FloatArray:
    """Returns the positions of left and right gripper at the start, p_WG (2,3), m."""
    hung = hung_garment(p)
    return np.stack([hung[p.mesh.grasp[side]].mean(axis=0) for side in SIDES])


def robots_at_start(
    p: StationParameters, placement: ArmPlacement, body: BodyMeasures, person: Person
) -> ArmSetup:
    """Returns two arms whose grippers hold the coat at the start of a run.

    An armhole hangs below its gripper and has to go over the hand and up to the shoulder, so
    grippers must also reach points above hand and shoulder.

    Raises:
        ArmReachError: the arms cannot reach the start or these points.
    """
    capsules = person_at_rest(p, body, person)
    setup = set_up_arms(placement, start_grippers(p), capsules)
    joints = np.stack([arm_points(body, p.posture, side, p.arms[side]) for side in SIDES])
    rest = p.mesh.rest_position
    drop = [
        np.linalg.norm(
            rest[p.mesh.grasp[side]].mean(axis=0)
            - rest[p.mesh.loops[f"{side}_armhole"]].mean(axis=0)
        )
        for side in SIDES
    ]
    above = np.outer(drop, [0.0, 0.0, 1.0])
    places = {
        "above the person's hand": joints[:, 2] + above,
        "above the person's shoulder": joints[:, 0] + above,
    }
    check_reach(setup, placement, places, capsules)
    return setup


def plant_integrator(p: StationParameters) -> ReleasableCloth:
    """Returns the integrator of the plant's garment, which both grippers hold or let go."""
    return ReleasableCloth(partial(_integrator, p), p.mesh.held)


def _integrator(p: StationParameters, held: IntArray) -> Integrator:
    """Returns the integrator of the plant's garment with the nodes `held` prescribed."""
    settings: ImplicitSettings | ProjectiveSettings
    if p.integrator == "mujoco":
        # layers collide within its own step
        return _with_effects(
            p, Scheme(held, p.time_step, MujocoSettings(self_collision=p.self_collision))
        )
    if p.integrator == "projective_dynamics":
        settings = ProjectiveSettings(quasi_newton=True)
    else:
        settings = ImplicitSettings(
            p.tolerance,
            p.iterations,
            implicitness=p.implicitness,
            buckling_wavelength=p.buckling_wavelength,
        )
    integrator = _with_effects(p, Scheme(held, p.time_step, settings))
    return LayeredCloth(integrator) if p.self_collision else integrator


def _with_effects(p: StationParameters, make: MakeIntegrator) -> GarmentWithEffects:
    return GarmentWithEffects(
        p.mesh.rest_position, p.mesh.faces, grain(p.mesh), p.material, p.effects, make
    )


def settled(p: StationParameters, hung: FloatArray) -> FloatArray:
    """Returns the garment (n,3), m, after it has hung from resting grippers for a while.

    Layers that would cross are kept apart already here: panels that hang through each other at the
    start stay hooked.
    """
    settings = ImplicitSettings(buckling_wavelength=p.buckling_wavelength)
    plain = _with_effects(p, Scheme(p.mesh.held, p.time_step, settings, _SETTLING_DAMPING))
    cloth: Integrator = LayeredCloth(plain) if p.self_collision else plain
    state = ClothState.at_rest(hung)
    still = np.zeros((len(p.mesh.held), 3))
    for _ in range(int(_SETTLING_TIME / p.time_step)):
        state, _ = cloth.step(state, Obstacles.none(), still)
    return state.x
