"""What a scenario's YAML may say: plain dataclasses, which Drake's `yaml_load_typed` fills.

A default that a model has, too, is the model's: groups that are a model's settings mirror them,
others refer to them. `tests/diagrams/test_defaults.py` holds both against each other.
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from drake_dress.diagrams.person import JointParameters
from drake_dress.diagrams.scenario.fidelity import FIDELITIES
from drake_dress.diagrams.scenario.mirror import Mirror, mirror_of
from drake_dress.models.arm.status_check import JointBounds
from drake_dress.models.cloth import material
from drake_dress.models.control import costs, local_model, policy, safety, task_parameters
from drake_dress.models.control.own_costs import COSTS
from drake_dress.models.dressing import stages
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.models.garment.load import MeshOptions
from drake_dress.models.human import body, following, motions, tremor
from drake_dress.models.human.active import ActiveParameters
from drake_dress.models.supervision.garment_belief import GarmentBounds
from drake_dress.models.supervision.garment_shape import ShapeBounds
from drake_dress.models.supervision.person_belief import PersonBounds
from drake_dress.models.supervision.person_pose import PoseBounds
from drake_dress.models.supervision.supervision import Patience

# By name, then by parameter: of a section that users add to, see `SCHEMAS`.
ValuesByName = dict[str, dict[str, float]]

_STANDARD = FIDELITIES["standard"]
_POLICY = policy.PolicyParameters()
_LOCAL = local_model.LocalParameters
_SAFETY = safety.SafetyLimits


@dataclass
class Coat:
    """A parametric coat: a preset with single measures replaced, all of them scaled; m."""

    preset: str = "overcoat"
    scale: float = 1.0  # on all lengths, given ones too
    body_length: float | None = None  # shoulder tips to hem
    chest: float | None = None  # girth
    shoulder_width: float | None = None  # tip to tip
    sleeve_length: float | None = None  # shoulder tip to cuff
    armhole_girth: float | None = None
    cuff_girth: float | None = None
    collar_height: float | None = None
    neck_width: float | None = None  # between the inner ends of the shoulder seams
    shoulder_slope: float | None = None  # height of the seam's inner end above its outer end
    front_opening: float | None = None  # between the front edges, part of the chest girth
    # What each gripper holds: a patch of 7 cm across, of four nodes at least, or the whole shoulder
    # seam, as a hanger does.
    grasp: str = "patch"


@dataclass
class Mesh:
    """A garment of the user's own, instead of the coat."""

    file: str = ""  # OBJ, PLY or STL, relative to the scenario
    unit: str = MeshOptions.unit  # of its coordinates
    scale: float = MeshOptions.scale  # on all coordinates, beside the unit
    # Axis of the file that points up. With z the garment faces +x, with y +z, with x +y; a minus
    # sign turns it upside down.
    up: str = MeshOptions.up
    # distance across which edges of seams are sewn, m; 0: equal nodes alone
    weld: float = MeshOptions.weld
    # Names of objects or groups, or sizes such as "<0.05 m" of parts that are connected.
    leave_out: list[str] = field(default_factory=list)
    loops: dict[str, list[int]] = field(default_factory=dict)  # nodes in order, by loop name
    grasp: dict[str, list[int]] = field(default_factory=dict)  # nodes held, by side


@dataclass
class Garment:
    """The garment's pattern; plant and controller mesh it each at its own spacing."""

    coat: Coat = field(default_factory=Coat)
    mesh: Mesh | None = None


@dataclass
class Material:
    """A fabric, SI units; see models/cloth/material.py."""

    surface_density: float = material.Material.surface_density  # kg/m²
    stretch_stiffness: float = material.Material.stretch_stiffness  # N/m
    bending_stiffness: float = material.Material.bending_stiffness  # N·m
    damping: float = 0.003  # s, of the plant's integrator
    friction: float = material.Material.friction
    margin: float = material.Material.margin  # m, kept between node and skin


@mirror_of(body.BodyMeasures)
class Measures(Mirror):
    """Body sizes, m, and masses, kg; see models/human/body.py."""


@dataclass
class Arm:
    """Rest pose of an arm, degrees; all zero hangs straight down."""

    abduction_deg: float = 13.0  # sideways
    extension_deg: float = 46.0  # backward
    rotation_deg: float = 0.0  # about its own axis
    elbow_deg: float = 10.0  # flexion


@dataclass
class Joints:
    """How the arms yield: N·m/rad and N·m·s/rad."""

    shoulder_stiffness: float = JointParameters.shoulder_stiffness
    shoulder_damping: float = JointParameters.shoulder_damping
    elbow_stiffness: float = JointParameters.elbow_stiffness
    elbow_damping: float = JointParameters.elbow_damping


@mirror_of(following.FollowingParameters)
class Following(Mirror):
    """How a person gives way who lets the garment lead; see models/human/following.py."""


@dataclass
class Reach:
    """The hand goes into the sleeve, once its armhole is near."""

    side: str = "both"
    start: float = motions.Reach.start  # s, at the earliest
    within: float = motions.Reach.within  # from hand to armhole, m
    push: float = motions.Reach.push  # of the hand beyond the armhole; then it follows, m


@dataclass
class Turn:
    """The body turns about the vertical and stays so."""

    angle_deg: float = 15.0  # leftward
    start: float = 15.0  # s
    duration: float = motions.Turn.duration  # s


@dataclass
class Withdraw:
    """The hand is drawn to the body's side for a while, then goes back."""

    side: str = "both"
    start: float = 10.0  # s
    duration: float = motions.Withdraw.duration  # s
    distance: float = motions.Withdraw.distance  # m


@dataclass
class Wave:
    """The hand goes to and fro sideways."""

    side: str = "both"
    start: float = 10.0  # s
    duration: float = motions.Wave.duration  # s
    amplitude: float = motions.Wave.amplitude  # m
    frequency: float = motions.Wave.frequency  # Hz


@dataclass
class Motion:
    """One motion of an active person: just one of these."""

    reach: Reach | None = None
    turn: Turn | None = None
    withdraw: Withdraw | None = None
    wave: Wave | None = None


@mirror_of(tremor.TremorParameters)
class Tremor(Mirror):
    """Shaking of both hands; 4 to 12 Hz and up to 2 cm, see models/human/tremor.py."""


@dataclass
class Behaviour:
    """What the person does of its own; the controller is not told."""

    # dummy: springs about the rest pose. passive: follows the garment. active: has motions of its
    # own, and follows between them.
    kind: str = "dummy"
    following: Following = field(default_factory=Following)
    motions: list[Motion] = field(default_factory=list)
    max_hand_speed: float = ActiveParameters.max_hand_speed  # of motions of the hand, m/s
    max_joint_speed: float = ActiveParameters.max_joint_speed  # likewise, rad/s
    tremor: Tremor | None = None


@dataclass
class Person:
    """The person, or a dummy: a person without will."""

    posture: str = "standing"
    measures: Measures = field(default_factory=Measures)
    left_arm: Arm = field(default_factory=Arm)
    right_arm: Arm = field(default_factory=Arm)
    joints: Joints = field(default_factory=Joints)
    behaviour: Behaviour = field(default_factory=Behaviour)


@dataclass
class Plant:
    """The simulated truth."""

    # fine, standard or quick: gives what is not given of spacing, time_step, body_time_step,
    # implicitness, buckling_wavelength and tolerance; see fidelity.py
    fidelity: str = "standard"
    spacing: float = _STANDARD["spacing"]  # of the garment's mesh, m
    time_step: float = _STANDARD["time_step"]  # of the garment, s
    body_time_step: float = _STANDARD[
        "body_time_step"
    ]  # of arms, grippers and the person's joints, s
    integrator: str = "implicit"  # or projective_dynamics: exact, and some thirty times slower
    # of the implicit integrator: 1 is implicit Euler, which damps more the longer the step; near
    # 0.5 it is of second order and may begin to jitter
    implicitness: float = _STANDARD["implicitness"]
    # of it: shortest wrinkle that the mesh can take, in spacings; what cloth would evade by shorter
    # ones gives way. 0: never
    buckling_wavelength: float = _STANDARD["buckling_wavelength"]
    iterations: int = 40  # of the implicit integrator's linear solver, at most
    tolerance: float = _STANDARD["tolerance"]  # residual by momentum at which it stops
    self_collision: bool = True  # layers of the garment do not pass through each other
    # of a gripper's arm and grasp where a person pushes against what it holds, N/m: an arm under
    # impedance control, by the translational stiffness that libfranka's examples set
    grasp_stiffness: float = 3000.0
    material: Material = field(default_factory=lambda: Material(stretch_stiffness=1500.0))


@mirror_of(costs.Weights)
class Weights(Mirror):
    """Of the global controller's costs; see models/control/costs.py."""


@mirror_of(task_parameters.Approach)
class Approach(Mirror):
    """A way to approach a hand; see models/control/task_parameters.py."""


@mirror_of(stages.StageParameters, without=("waiting_progress",))
class Stages(Mirror):
    """Thresholds between the stages of a dressing; see models/dressing/stages.py."""


@mirror_of(task_parameters.TaskParameters, without=("progress_rate", "approach_distance", "stages"))
class Tasks(Mirror):
    """Where the sleeves are sent; see models/control/task_parameters.py."""


@dataclass
class GlobalMpc:
    """The global controller."""

    period: float = 0.5  # between solves, s
    # From what is seen to the use of the plan, s, a multiple of time_step; or "measured": the least
    # such one that 95 % of the solves keep on this machine, of drake-dress bench delay.
    delay: float = round(_POLICY.committed_steps * _POLICY.time_step, 9)
    time_step: float = _POLICY.time_step  # of the prediction, s
    horizon: int = _POLICY.horizon  # steps
    max_iterations: int = _POLICY.max_iterations  # gradient steps per solve
    # Of a solve, in iterations of linear solves, of 0.1 to 0.2 ms; what is best when it is spent is
    # used. Any number if empty. On hardware a solve has a share of its delay instead.
    budget: int | None = _POLICY.budget.iterations
    delay_share: float = 0.9  # of the delay, that a solve may take on hardware
    # of the garment's linear solve; 1 is the paper's scheme
    inner_iterations: int = _POLICY.inner_iterations
    max_speed: float = _POLICY.max_speed  # of a gripper, m/s
    weights: Weights = field(default_factory=Weights)
    progress_step: float = round(
        _POLICY.tasks.progress_rate * _POLICY.time_step, 9
    )  # advance of s asked for per step (k)
    approach_distance: float = _POLICY.tasks.approach_distance  # cap of l_h, m
    waiting_progress: float = _POLICY.tasks.stages.waiting_progress  # least s of a waiting sleeve
    force_limit: float | None = None  # deprecated, N: is safety.force_limit now


@dataclass
class Local:
    """The local controller; see models/control/local_model.py."""

    period: float = 0.02  # between solves, s
    delay: float = 0.002  # from what is seen to the use of the solution, s
    time_step: float = _LOCAL.time_step  # of the problem, s
    horizon: int = _LOCAL.horizon  # steps
    position: float = _LOCAL.position  # weight of sleeves
    speed: float = _LOCAL.speed  # weight of the grippers' speed, s²/m² of a step
    max_speed: float = _LOCAL.max_speed  # of a gripper, m/s
    stretch: float = _LOCAL.stretch  # share of the distances that the garment reaches, that is used
    beside: float = _LOCAL.beside  # that a dressed sleeve may be beside its target, m
    beside_speed: float = _LOCAL.beside_speed  # that it may move beside its arm, m/s
    # at which bounds that are exceeded come back where nothing is planned, m/s
    return_speed: float = _LOCAL.return_speed
    dragged: float = _LOCAL.dragged  # how far a hand is taken to be pushed by the garment, m
    # share of what a sleeve is off from where the plan foresaw it, that is made up for:
    prepare_correction: float = _LOCAL.prepare_correction  # while it is prepared
    dress_correction: float = _LOCAL.dress_correction  # while it is drawn on
    # shares of what the garment reaches from a gripper and between the armholes: from which on a
    # sleeve follows the other gripper, too; beyond which sleeves are coupled; below which no more
    taut_share: float = _LOCAL.taut_share
    coupled_share: float = _LOCAL.coupled_share
    released_share: float = _LOCAL.released_share
    feedback: bool = True  # corrects between solves by the solution's gains
    solver: str = "constrained_ddp"  # or cone: Clarabel, exact and slower


@dataclass
class Controller:
    """What the controllers believe and how they act."""

    spacing: float = 0.05  # of the believed garment's mesh, m
    material: Material = field(default_factory=Material)
    method: str = "global"  # global plan alone, local compensation alone, or full: both
    global_mpc: GlobalMpc = field(default_factory=GlobalMpc)
    tasks: Tasks = field(default_factory=Tasks)
    stages: Stages = field(default_factory=Stages)
    local: Local = field(default_factory=Local)
    # how the arms are believed to move on: still, or constant_velocity
    predictor: str = "still"
    # costs of a user's own by name, each with its fields; see models/control/own_costs.py
    costs: ValuesByName = field(default_factory=dict)
    command_rate: float = 100.0  # Hz


@dataclass
class Workspace:
    """A box in the world frame that the grippers' commands stay in; m."""

    low: list[float] = field(default_factory=list)  # x, y, z
    high: list[float] = field(default_factory=list)


@dataclass
class Safety:
    """Limits that no controller's request gets past; see models/control/safety.py."""

    max_speed: float = _SAFETY.max_speed  # of a gripper's command, m/s
    max_acceleration: float = _SAFETY.max_acceleration  # the same, m/s²
    # where the other limits need it; never exceeded, m/s²
    max_braking: float = _SAFETY.max_braking
    # no pulling from here on, N; beyond it grippers give way
    force_limit: float = _SAFETY.hard_force
    soft_force_limit: float | None = None  # pulling fades from here on, N; half of it if empty
    force_filter_time: float = _SAFETY.filter_time  # of the force's low-pass, s
    yield_rate: float = _SAFETY.yield_rate  # speed of giving way per force beyond the limit, m/s/N
    yield_speed: float = _SAFETY.yield_speed  # of giving way, at most, m/s
    relax_speed: float = _SAFETY.relax_speed  # of giving way while stopped, m/s
    # beyond the force limit, after which both grippers stop, s
    stop_time: float = _SAFETY.stop_time
    max_lead: float = _SAFETY.max_lead  # of a command before its gripper, m
    stale_time: float = _SAFETY.stale_time  # age at which a request is not obeyed any more, s
    person_distance: float = _SAFETY.person_distance  # of a gripper to the person's skin, m
    # likewise of the cloth that it holds, m: a fold fits between
    held_distance: float = _SAFETY.held_distance
    least_distance: float = _SAFETY.least_distance  # between the grippers, m
    largest_distance: float | None = None  # between the grippers, m; any if empty
    workspace: Workspace | None = None  # everywhere if empty


@dataclass
class Gripper:
    """Limits of a floating gripper: m/s, m/s²."""

    max_speed: float = 0.25
    max_acceleration: float = 2.0


@dataclass
class Start:
    """Where the coat hangs at first, from the shoulders' middle, m."""

    distance_behind: float = 0.75
    height_offset: float = 0.0
    lateral_offset: float = 0.0


@dataclass
class Arms:
    """What carries the grippers: nothing (they float), or two Panda arms behind the person."""

    model: str = "floating"  # or panda
    distance_behind: float = 0.7  # of the arms' bases behind the person, m
    spread: float = 1.1  # between them, m
    height_offset: float = -0.25  # of both, over the person's shoulders, m
    tilt_deg: float = 35.0  # of the hands, which point forward and this much down
    rate: float = 200.0  # of the joints' commands, Hz
    mode: str = "position_velocity"  # what is commanded: or position, or velocity alone


@dataclass
class Beliefs:
    """What messages of hardware may say to be believed; arms hold at what goes beyond it."""

    # Of an arm's status:
    joint_leap: float = JointBounds.leap  # of a joint between messages beyond its speed limit, rad
    # of a joint's torque limit that may push it from outside
    torque_share: float = JointBounds.torque_share
    # Of the person, against the scenario's measures and joints:
    # of a point, m; trackers of bodies are good to 1 to 3 cm
    point_error: float = PoseBounds.point_error
    limb_share: float = PoseBounds.length_share  # by which a real limb may differ from the measures
    # of the shoulders' middle from where it is described, m
    shoulder_distance: float = PoseBounds.shoulder_distance
    turn_deg: float = math.degrees(PoseBounds.turn)  # of the shoulders about the vertical
    # that a supple person's joints may go beyond the limits
    joint_room_deg: float = math.degrees(PoseBounds.joint_room)
    person_speed: float = PersonBounds.speed  # of a point, m/s; a hand that is drawn back in alarm
    # for which a point that changed with each message may stay the same to the last bit, s; a real
    # tracker has noise; 0 does not judge it
    frozen_time: float = PersonBounds.frozen_time
    # Of the garment, against the controller's mesh and the grippers:
    # standard deviation on each axis, m; depth cameras have 0.5 to 1 cm
    node_noise: float = ShapeBounds.node_noise
    # of an edge; coats stretch by 10 % in the hand, 20 % at most
    strain: float = ShapeBounds.strain
    # share of their length at rest, root mean square; folds shorten edges
    least_edge: float = ShapeBounds.least_edge
    # of the held nodes' middle from their gripper, m
    grasp_distance: float = ShapeBounds.grasp_distance
    # of a node between messages, m/s; a hem that swings does 1.7
    garment_speed: float = GarmentBounds.speed
    # of a node as it is reported, m/s: speed and its noise
    garment_velocity: float = GarmentBounds.velocity
    # of reported velocities against motion, m/s
    velocity_error: float = GarmentBounds.velocity_error
    # of a gripper while the garment stays the same, m; 0: not judged
    frozen_travel: float = GarmentBounds.frozen_travel


@dataclass
class Hardware:
    """Of a station of kind hardware, and of the lab that `drake-dress sim-station` plays."""

    # ttl 0 keeps messages on this machine
    lcm_url: str = "udpm://239.255.76.67:7667?ttl=0"
    status_channel: str = "PANDA_STATUS"  # of the arms; _LEFT and _RIGHT are appended
    command_channel: str = "PANDA_COMMAND"  # the same
    garment_channel: str = "GARMENT_ESTIMATE"
    person_channel: str = "PERSON_ESTIMATE"
    camera_channel: str = "CAMERA"  # _NAME is appended
    status_rate: float = 200.0  # of the lab, Hz
    estimate_rate: float = 50.0  # of the lab, Hz
    # Age at which arms hold, s. What is older than the newest message by no more is dropped.
    stale_status: float = 0.05
    stale_estimate: float = 0.2  # the same
    stale_camera: float = 0.5  # the same
    settle_time: float = Patience.settle_time  # for which all must be well before arms go on, s
    patience: float = Patience.fault  # with what is wrong, before the run ends, s
    wait: float = 10.0  # for the first messages, s
    start_distance: float = 0.02  # of a gripper from where the run begins, at most, m
    start_angle: float = 0.1  # of a joint, rad
    beliefs: Beliefs = field(default_factory=Beliefs)


@dataclass
class Camera:
    """A camera for colour and depth that looks at the person; world frame, m."""

    name: str = ""
    position: list[float] = field(default_factory=list)  # x, y, z
    target: list[float] = field(default_factory=list)  # what is in the middle of its image
    width: int = 320  # pixels
    height: int = 240
    fov_deg: float = 60.0  # vertical
    rate: float = 5.0  # of images, Hz


@dataclass
class Station:
    """Robots, or what stands in for them."""

    kind: str = "simulated"  # or hardware: the same behind LCM messages
    arms: Arms = field(default_factory=Arms)
    hardware: Hardware = field(default_factory=Hardware)
    gripper: Gripper = field(default_factory=Gripper)
    start: Start = field(default_factory=Start)
    cameras: list[Camera] = field(default_factory=list)


@dataclass
class LabFault:
    """Something that goes wrong in the lab that `drake-dress sim-station` plays."""

    kind: str = "stale"  # see models/supervision/injection.py
    source: str = "left_arm"  # or right_arm, garment, person, camera_<name>; a lost bus is of all
    start: float = 5.0  # s after the first command
    duration: float = 1.0  # s


@dataclass
class Lab:
    """The lab that `drake-dress sim-station` plays; a run does not know of it."""

    faults: list[LabFault] = field(default_factory=list)
    stale_command: float = 0.1  # age of commands at which arms stop by themselves, s
    wait: float = 300.0  # for the first command, s
    rest: float = 3.0  # after the last command, before the lab closes, s
    push: float = 60.0  # of a fault of kind push, N
    # standard deviation of the person's reported points on each axis, m: no tracker repeats itself
    # to the last bit, as a dummy that stands still would
    person_noise: float = 1e-4


@dataclass
class Variation:
    """What the seed draws, uniformly within ± these."""

    arm_angle_deg: float = 0.0  # on each arm's abduction, extension and elbow
    coat_scale: float = 0.0  # relative, on all lengths of the garment at once
    coat_measures: float = 0.0  # relative, on each measure of the coat by itself
    person_scale: float = 0.0  # relative, on all lengths of the body at once; masses as the cube
    person_measures: float = 0.0  # relative, on each measure of the body by itself
    plant_stiffness: float = 0.0  # relative, on stretch and bending
    plant_friction: float = 0.0  # relative
    start_offset: float = 0.0  # m, on each of the three


def _effect_schema(effect: type[Effect]) -> type:
    """Returns a dataclass with an effect's parameters and their standard deviations."""
    entries: list[tuple[str, Any, Any]] = []
    for p in effect.parameters():
        entries.append((p.name, float, field(default=p.off)))
        # as `drake-dress explain` found it; not used by the simulation
        entries.append((f"{p.name}_std", float, field(default=0.0)))
    return dataclasses.make_dataclass(effect.__name__, entries)


def effects_schema() -> type:
    """Returns a dataclass with every effect that is known now, those that users registered too."""
    entries = [(n, _effect_schema(e) | None, field(default=None)) for n, e in EFFECTS.items()]
    return dataclasses.make_dataclass("Effects", entries)


def costs_schema() -> type:
    """Returns a dataclass with every cost that users registered until now."""
    entries: list[tuple[str, Any, Any]] = []
    for name, kind in COSTS.items():
        below = [(f.name, float, field(default=f.default)) for f in dataclasses.fields(kind)]
        entries.append((name, dataclasses.make_dataclass(name, below) | None, field(default=None)))
    return dataclasses.make_dataclass("Costs", entries)


# Sections whose names are those that are known when a scenario is read.
SCHEMAS: dict[str, Callable[[], type]] = {
    "effects": effects_schema,
    "controller.costs": costs_schema,
}


@dataclass
class Log:
    """What is written while the run goes on."""

    rate: float = 30.0  # Hz


@dataclass
class Scenario:
    """One run."""

    seed: int = 0
    duration: float = 90.0  # at most, s
    garment: Garment = field(default_factory=Garment)
    person: Person = field(default_factory=Person)
    plant: Plant = field(default_factory=Plant)
    controller: Controller = field(default_factory=Controller)
    safety: Safety = field(default_factory=Safety)
    station: Station = field(default_factory=Station)
    lab: Lab = field(default_factory=Lab)
    variation: Variation = field(default_factory=Variation)
    log: Log = field(default_factory=Log)
    # physical effects by name, each with its parameters in SI units; see models/effects/
    effects: ValuesByName = field(default_factory=dict)
