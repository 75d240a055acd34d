"""From a scenario's values to the parts of the dressing diagram."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.multibody.plant import MultibodyPlant

from drake_dress.diagrams.arms import ArmPlacement, ArmSetup
from drake_dress.diagrams.behaviour import Behaviour, Kind
from drake_dress.diagrams.cameras import Camera
from drake_dress.diagrams.dressing import LocalSetup, Rates
from drake_dress.diagrams.hardware_station import Beliefs, HardwareParameters, Links
from drake_dress.diagrams.person import JointParameters, Person, add_person, person_arms
from drake_dress.diagrams.scenario import schema
from drake_dress.diagrams.scenario.mirror import model_of
from drake_dress.diagrams.station import (
    Sight,
    SimulatedStation,
    StationParameters,
    make_simulated_station,
    robots_at_start,
)
from drake_dress.errors import UserError
from drake_dress.models.arm.panda import LIMITS, panda
from drake_dress.models.arm.status_check import JointBounds
from drake_dress.models.cloth.material import Material
from drake_dress.models.control.budget import Budget
from drake_dress.models.control.constrained_ddp import solve
from drake_dress.models.control.costs import GarmentCost
from drake_dress.models.control.local_control import LocalController
from drake_dress.models.control.local_model import LocalParameters
from drake_dress.models.control.own_costs import registered_costs
from drake_dress.models.control.person_model import PersonModel
from drake_dress.models.control.policy import DressingPolicy, PolicyParameters
from drake_dress.models.control.safety import SafetyLimits
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.registry import EFFECTS, HOW_TO_LOAD
from drake_dress.models.garment.edges import unique_edges
from drake_dress.models.garment.mesh import GarmentMesh, edge_lengths
from drake_dress.models.garment.transfer import barycentric_transfer
from drake_dress.models.human import motions
from drake_dress.models.human.active import ActiveParameters
from drake_dress.models.human.body import (
    ArmPose,
    BodyMeasures,
    Posture,
    shoulder_height,
    shoulder_joint,
)
from drake_dress.models.human.prediction import PREDICTORS, MotionPredictor
from drake_dress.models.sides import SIDES, Side
from drake_dress.models.supervision.garment_belief import GarmentBounds
from drake_dress.models.supervision.garment_shape import ShapeBounds
from drake_dress.models.supervision.person_belief import PersonBounds
from drake_dress.models.supervision.person_pose import PoseBounds
from drake_dress.models.supervision.supervision import Patience
from drake_dress.solvers.cone_programme import cone_programme


def plant_station(
    scenario: schema.Scenario,
    mesh: GarmentMesh,
    meshcat: Meshcat | None,
    belief: GarmentMesh | None = None,
    in_worker: bool = False,
) -> SimulatedStation:
    """Returns the simulated station with the scenario's person and garment.

    Args:
        scenario: with nothing left to draw.
        mesh: the true garment.
        meshcat: where it is shown, if it is.
        belief: the controller's garment, of which there are estimates then.
        in_worker: whether the true garment is stepped in a process of its own.
    """
    sight = None
    if belief is not None:
        sight = Sight(barycentric_transfer(mesh, belief), 1.0 / scenario.controller.command_rate)
    p = replace(station_parameters(scenario, mesh), in_worker=in_worker)
    return make_simulated_station(p, meshcat, sight)


def described_person(p: StationParameters) -> Person:
    """Returns the person as it is described, in a plant of its own that nobody simulates."""
    return add_person(
        MultibodyPlant(p.body_time_step), p.measures, p.posture, p.arms, p.joints, turns=False
    )


def planned_arms(p: StationParameters, person: Person) -> ArmSetup:
    """Returns two arms where a run begins.

    Raises:
        ArmReachError: they do not reach there, or not where a dressing leads.
    """
    if p.placement is None:
        raise ValueError("grippers float, expected arms")
    return robots_at_start(p, p.placement, p.measures, person)


def links(scenario: schema.Scenario) -> Links:
    """Returns where a hardware station's messages go."""
    h = scenario.station.hardware
    return Links(
        lcm_url=h.lcm_url,
        status=h.status_channel,
        command=h.command_channel,
        garment=h.garment_channel,
        person=h.person_channel,
        camera=h.camera_channel,
        command_period=1.0 / scenario.station.arms.rate,
    )


def hardware_parameters(scenario: schema.Scenario, mesh: GarmentMesh) -> HardwareParameters:
    """Returns what a hardware station is made of, with estimates of the garment `mesh`.

    Raises:
        ValueError: the scenario's grippers float.
    """
    h, stand = scenario.station.hardware, placement(scenario)
    if stand is None:
        raise ValueError("grippers float, expected arms")
    left, right = (panda(stand.base(side)) for side in SIDES)
    return HardwareParameters(
        links=links(scenario),
        mode=scenario.station.arms.mode,
        node_count=len(mesh.rest_position),
        arms=(left, right),
        beliefs=beliefs(scenario, mesh),
        cameras=tuple(c.name for c in scenario.station.cameras),
        stale_status=h.stale_status,
        stale_estimate=h.stale_estimate,
        stale_camera=h.stale_camera,
        patience=Patience(h.settle_time, h.patience),
        wait=h.wait,
        start_distance=h.start_distance,
        start_angle=h.start_angle,
    )


def beliefs(scenario: schema.Scenario, mesh: GarmentMesh) -> Beliefs:
    """Returns what messages may say of the arms, the scenario's person, and the garment `mesh`."""
    b = scenario.station.hardware.beliefs
    body, stance = measures(scenario.person), posture(scenario.person)
    poses: dict[Side, ArmPose] = {
        "left": arm(scenario.person.left_arm),
        "right": arm(scenario.person.right_arm),
    }
    joints = JointParameters(**vars(scenario.person.joints))
    pose = PoseBounds(
        shoulders=np.stack([shoulder_joint(body, stance, side) for side in SIDES]),
        limbs=(body.upper_arm_length, body.forearm_length),
        limits=person_arms(body, stance, poses, joints).limits,
        point_error=b.point_error,
        length_share=b.limb_share,
        shoulder_distance=b.shoulder_distance,
        turn=math.radians(b.turn_deg),
        joint_room=math.radians(b.joint_room_deg),
    )
    shape = ShapeBounds(
        edges=unique_edges(mesh.faces),
        rest_length=edge_lengths(mesh.rest_position, mesh.faces),
        grasp=(mesh.grasp["left"], mesh.grasp["right"]),
        extent=float(np.linalg.norm(np.ptp(mesh.rest_position, axis=0))),
        node_noise=b.node_noise,
        strain=b.strain,
        least_edge=b.least_edge,
        grasp_distance=b.grasp_distance,
    )
    return Beliefs(
        joints=JointBounds(LIMITS, b.joint_leap, b.torque_share),
        person=PersonBounds(pose, b.person_speed, b.frozen_time),
        garment=GarmentBounds(
            shape, b.garment_speed, b.garment_velocity, b.velocity_error, b.frozen_travel
        ),
    )


def station_parameters(scenario: schema.Scenario, mesh: GarmentMesh) -> StationParameters:
    """Returns what the simulated station is made of."""
    person, start = scenario.person, scenario.station.start
    return StationParameters(
        mesh=mesh,
        material=material(scenario.plant.material),
        time_step=scenario.plant.time_step,
        body_time_step=scenario.plant.body_time_step,
        integrator=scenario.plant.integrator,
        implicitness=scenario.plant.implicitness,
        buckling_wavelength=scenario.plant.buckling_wavelength,
        iterations=scenario.plant.iterations,
        tolerance=scenario.plant.tolerance,
        self_collision=scenario.plant.self_collision,
        grasp_stiffness=scenario.plant.grasp_stiffness,
        effects=effects(scenario),
        measures=measures(person),
        posture=posture(person),
        arms={"left": arm(person.left_arm), "right": arm(person.right_arm)},
        joints=JointParameters(**vars(person.joints)),
        behaviour=behaviour(scenario),
        gripper_max_speed=scenario.station.gripper.max_speed,
        gripper_max_acceleration=scenario.station.gripper.max_acceleration,
        distance_behind=start.distance_behind,
        height_offset=start.height_offset,
        lateral_offset=start.lateral_offset,
        placement=placement(scenario),
        mode=scenario.station.arms.mode,
        cameras=cameras(scenario),
    )


def cameras(scenario: schema.Scenario) -> tuple[Camera, ...]:
    """Returns the scenario's cameras; degrees become radians."""
    return tuple(
        Camera(
            c.name,
            np.array(c.position),
            np.array(c.target),
            c.width,
            c.height,
            math.radians(c.fov_deg),
            c.rate,
        )
        for c in scenario.station.cameras
    )


def placement(scenario: schema.Scenario) -> ArmPlacement | None:
    """Returns where arms stand; None where grippers float."""
    arms = scenario.station.arms
    if arms.model == "floating":
        return None
    shoulders = shoulder_height(measures(scenario.person), posture(scenario.person))
    return ArmPlacement(
        arms.distance_behind,
        arms.spread,
        shoulders + arms.height_offset,
        math.radians(arms.tilt_deg),
    )


def controller_policy(
    scenario: schema.Scenario,
    mesh: GarmentMesh,
    person: Person,
    costs: Sequence[GarmentCost] = (),
) -> DressingPolicy:
    """Returns the global controller's policy on its own garment `mesh`; `costs` are a user's."""
    c, m = scenario.controller, measures(scenario.person)
    g = c.global_mpc
    shape = PersonModel(
        capsules=person.capsules,
        shoulders=np.stack([shoulder_joint(m, posture(scenario.person), side) for side in SIDES]),
        radius=(m.upper_arm_radius, m.forearm_radius, m.hand_radius),
    )
    parameters = PolicyParameters(
        time_step=g.time_step,
        horizon=g.horizon,
        max_iterations=g.max_iterations,
        inner_iterations=g.inner_iterations,
        committed_steps=round(g.delay / g.time_step),
        max_speed=g.max_speed,
        plans=c.method != "local",
        budget=solve_budget(scenario),
        weights=model_of(g.weights),
        tasks=model_of(
            c.tasks,
            progress_rate=g.progress_step / g.time_step,
            approach_distance=g.approach_distance,
            stages=model_of(c.stages, waiting_progress=g.waiting_progress),
        ),
    )
    all_costs = (*registered_costs(c.costs), *costs)
    return DressingPolicy(mesh, material(c.material), shape, parameters, all_costs)


def solve_budget(scenario: schema.Scenario) -> Budget:
    """Returns what a plan may take: work in simulation, time where the world does not wait."""
    g = scenario.controller.global_mpc
    if scenario.station.kind == "hardware":
        return Budget(seconds=g.delay_share * g.delay)
    return Budget(iterations=g.budget)


# Between the joints that are predicted for the local controller, s.
_JOINTS_STEP = 0.2


def local_setup(scenario: schema.Scenario, policy: DressingPolicy) -> LocalSetup | None:
    """Returns the local controller; None where the global plan is followed as it is."""
    if scenario.controller.method == "global":
        return None
    values = scenario.controller.local
    parameters = LocalParameters(
        **{
            f.name: getattr(values, f.name)
            for f in fields(LocalParameters)
            if f.name in vars(values)
        }
    )
    solvers = {"constrained_ddp": solve, "cone": cone_programme}
    return LocalSetup(
        LocalController(policy.planner, parameters, solvers[values.solver]),
        values.period,
        values.delay,
        values.feedback,
        _JOINTS_STEP,
        math.ceil(values.horizon * values.time_step / _JOINTS_STEP),
    )


def behaviour(scenario: schema.Scenario) -> Behaviour:
    """Returns what the person does of its own."""
    b = scenario.person.behaviour
    kinds: dict[str, Kind] = {"passive": "passive", "active": "active"}
    return Behaviour(
        kind=kinds.get(b.kind, "dummy"),
        active=ActiveParameters(
            following=model_of(b.following),
            max_hand_speed=b.max_hand_speed,
            max_joint_speed=b.max_joint_speed,
        ),
        motions=tuple(motion(m) for m in b.motions),
        tremor=model_of(b.tremor) if b.tremor is not None else None,
        seed=scenario.seed,
    )


def motion(values: schema.Motion) -> motions.Motion:
    """Returns the one motion that is given; degrees become radians."""
    if values.turn is not None:
        turn = values.turn
        return motions.Turn(
            start=turn.start, angle=float(np.deg2rad(turn.angle_deg)), duration=turn.duration
        )
    kinds = {"reach": motions.Reach, "withdraw": motions.Withdraw, "wave": motions.Wave}
    name = next(n for n in kinds if getattr(values, n) is not None)
    given = dict(vars(getattr(values, name)))
    side = given.pop("side")
    return kinds[name](sides=tuple(s for s in SIDES if side in (s, "both")), **given)


def predictor(scenario: schema.Scenario) -> MotionPredictor:
    """Returns how the controller believes that the arms move on."""
    return PREDICTORS[scenario.controller.predictor]()


def effects(scenario: schema.Scenario) -> tuple[Effect, ...]:
    """Returns the physical effects that the scenario switches on, in the order of the list.

    Raises:
        UserError: one is not known.
    """
    unknown = next((name for name in scenario.effects if name not in EFFECTS), None)
    if unknown is not None:
        raise UserError("scenario", f"effects.{unknown}", f"unknown effect ({HOW_TO_LOAD})")
    on = [_effect(n, scenario.effects[n]) for n in EFFECTS if n in scenario.effects]
    return tuple(e for e in on if not e.is_off)


def _effect(name: str, values: Mapping[str, float]) -> Effect:
    """Returns an effect with values, which need not come from a file that was checked."""
    kind = EFFECTS[name]
    names = [p.name for p in kind.parameters()]
    for key in values:
        if key.removesuffix("_std") not in names:
            raise UserError(
                "scenario", f"effects.{name}.{key}", f"unknown key, expected {', '.join(names)}"
            )
    return kind(**{n: values[n] for n in names if n in values})


def rates(scenario: schema.Scenario) -> Rates:
    """Returns periods and delays of controllers and log."""
    c = scenario.controller
    return Rates(
        global_period=c.global_mpc.period,
        global_delay=c.global_mpc.delay,
        command_period=1.0 / c.command_rate,
        log_period=1.0 / scenario.log.rate,
        arm_period=1.0 / scenario.station.arms.rate,
        plant_period=scenario.plant.body_time_step,
    )


def safety_limits(scenario: schema.Scenario) -> SafetyLimits:
    """Returns the limits that stand between controllers and grippers."""
    s = scenario.safety
    soft, largest, box = s.soft_force_limit, s.largest_distance, s.workspace
    return SafetyLimits(
        max_speed=s.max_speed,
        max_acceleration=s.max_acceleration,
        max_braking=s.max_braking,
        soft_force=0.5 * s.force_limit if soft is None else soft,
        hard_force=s.force_limit,
        filter_time=s.force_filter_time,
        yield_rate=s.yield_rate,
        yield_speed=s.yield_speed,
        relax_speed=s.relax_speed,
        stop_time=s.stop_time,
        max_lead=s.max_lead,
        stale_time=s.stale_time,
        person_distance=s.person_distance,
        held_distance=s.held_distance,
        least_distance=s.least_distance,
        largest_distance=np.inf if largest is None else largest,
        workspace=None if box is None else np.array([box.low, box.high]),
    )


def material(values: schema.Material) -> Material:
    """Returns the fabric."""
    return Material(**vars(values))


def measures(person: schema.Person) -> BodyMeasures:
    """Returns the body's sizes."""
    body: BodyMeasures = model_of(person.measures)
    return body


def posture(person: schema.Person) -> Posture:
    """Returns the posture; the scenario has been held against the two there are."""
    return "sitting" if person.posture == "sitting" else "standing"


def arm(values: schema.Arm) -> ArmPose:
    """Returns an arm's pose; degrees become radians."""
    return ArmPose(
        *np.deg2rad(
            [values.abduction_deg, values.extension_deg, values.rotation_deg, values.elbow_deg]
        )
    )
