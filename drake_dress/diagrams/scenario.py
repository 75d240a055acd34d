"""Scenarios: what a YAML file may say, and how it is read.

Drake's `yaml_load_typed` fills plain dataclasses. Before that the file is held against their types
so that a mistake is told with its dotted key, and after it against the ranges in `_RANGES`.
"""

import dataclasses
import difflib
import math
import re
import types
import typing
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed

from drake_dress.errors import UserError
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.models.human import motions
from drake_dress.models.supervision.injection import KINDS


@dataclass
class Coat:
    """A parametric coat: a preset, scaled, with single measures replaced; m."""

    preset: str = "overcoat"
    scale: float = 1.0  # on all lengths
    body_length: float | None = None  # shoulder tips to hem
    chest: float | None = None  # girth
    shoulder_width: float | None = None  # tip to tip
    sleeve_length: float | None = None  # shoulder tip to cuff
    armhole_girth: float | None = None
    cuff_girth: float | None = None
    collar_height: float | None = None
    front_opening: float | None = None  # between the front edges, part of the chest girth
    # What each gripper holds: a patch of ten nodes, or the whole shoulder seam, as a hanger does;
    # the seam is the same at every spacing, a patch of nodes is not.
    grasp: str = "patch"


@dataclass
class Mesh:
    """A garment of the user's own, instead of the coat."""

    file: str = ""  # OBJ, PLY or STL, relative to the scenario
    unit: str = "m"  # of its coordinates
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

    surface_density: float = 0.3  # kg/m²
    stretch_stiffness: float = 100.0  # N/m
    bending_stiffness: float = 1.5e-3  # N·m
    damping: float = 0.003  # s, of the plant's integrator
    friction: float = 0.3
    margin: float = 0.003  # m, kept between node and skin


@dataclass
class Measures:
    """Body sizes, m, and masses, kg."""

    shoulder_height: float = 1.40  # of the joints, standing
    shoulder_width: float = 0.36  # joint to joint
    upper_arm_length: float = 0.29
    forearm_length: float = 0.32  # elbow to middle of the hand
    upper_arm_radius: float = 0.045
    forearm_radius: float = 0.038
    hand_radius: float = 0.040
    chest_width: float = 0.32
    chest_depth: float = 0.20
    torso_length: float = 0.52
    hip_width: float = 0.32
    neck_radius: float = 0.055
    head_radius: float = 0.095
    leg_length: float = 0.85
    thigh_radius: float = 0.075
    upper_arm_mass: float = 1.6
    forearm_mass: float = 1.2


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

    shoulder_stiffness: float = 6.0
    shoulder_damping: float = 3.0
    elbow_stiffness: float = 3.6
    elbow_damping: float = 1.2


@dataclass
class Following:
    """How a person gives way who lets the garment lead; see models/human/following.py."""

    time_constant: float = 1.0  # in which a joint held away from where it was set is followed, s
    threshold: float = 0.3  # of the torque at a joint, up to which nothing is followed, N·m
    return_time_constant: float | None = None  # to the rest pose, s; empty: stays where it was led
    max_speed: float = 1.0  # of a joint's set-point, rad/s


@dataclass
class Reach:
    """The hand goes into the sleeve, once its armhole is near."""

    side: str = "both"
    start: float = 0.0  # s, at the earliest
    within: float = 0.25  # from hand to armhole, m
    push: float = 0.05  # of the hand beyond the armhole; then it follows, m


@dataclass
class Turn:
    """The body turns about the vertical and stays so."""

    angle_deg: float = 15.0  # leftward
    start: float = 15.0  # s
    duration: float = 3.0  # s


@dataclass
class Withdraw:
    """The hand is drawn to the body's side for a while, then goes back."""

    side: str = "both"
    start: float = 10.0  # s
    duration: float = 4.0  # s
    distance: float = 0.10  # m


@dataclass
class Wave:
    """The hand goes to and fro sideways."""

    side: str = "both"
    start: float = 10.0  # s
    duration: float = 3.0  # s
    amplitude: float = 0.05  # m
    frequency: float = 1.0  # Hz


@dataclass
class Motion:
    """One motion of an active person: just one of these."""

    reach: Reach | None = None
    turn: Turn | None = None
    withdraw: Withdraw | None = None
    wave: Wave | None = None


@dataclass
class Tremor:
    """Shaking of both hands; 4 to 12 Hz and up to 2 cm, see models/human/tremor.py."""

    amplitude: float = 0.005  # of the hand, m
    frequency: float = 5.0  # Hz


@dataclass
class Behaviour:
    """What the person does of its own; the controller is not told."""

    # dummy: springs about the rest pose. passive: follows the garment. active: has motions of its
    # own, and follows between them.
    kind: str = "dummy"
    following: Following = field(default_factory=Following)
    motions: list[Motion] = field(default_factory=list)
    max_hand_speed: float = 0.5  # of motions of the hand, m/s
    max_joint_speed: float = 2.5  # likewise, rad/s
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

    spacing: float = 0.02  # of the garment's mesh, m
    time_step: float = 0.004  # s
    integrator: str = "implicit"  # or projective_dynamics: exact, and some thirty times slower
    iterations: int = 40  # of the implicit integrator's linear solver, at most
    tolerance: float = 5e-3  # relative residual at which it stops
    self_collision: bool = False  # layers of the garment do not pass through each other
    material: Material = field(default_factory=lambda: Material(stretch_stiffness=1500.0))


@dataclass
class Weights:
    """Of the global controller's costs; see models/control/global_mpc.py."""

    position: float = 1.0
    direction: float = 0.05
    speed: float = 0.125
    safety: float = 3e-4
    free_force: float = 5.0  # N
    separation: float = 1.0
    least_spread: float = 0.5  # share of the grippers' distance at rest
    entering_spread: float = 0.85  # the same while a sleeve is entered
    level: float = 20.0  # on a garment that is turned on edge
    least_level: float = 0.5  # of the grippers' distance at rest: the left one is left of the right
    clearance: float = 10.0
    free_clearance: float = 0.05  # m
    corridor: float = 3.0  # on cloth that hangs ahead of a hand that is to go in
    corridor_radius: float = 0.06  # m
    corridor_length: float = 0.12  # m
    passage: float = 3.0  # on cloth that would cross the forearm if the hand were in the armhole
    passage_radius: float = 0.06  # m
    passage_length: float = 0.25  # m


@dataclass
class GlobalMpc:
    """The global controller."""

    period: float = 0.5  # between solves, s
    delay: float = 0.2  # from what is seen to the use of the plan, s; a multiple of time_step
    time_step: float = 0.2  # of the prediction, s
    horizon: int = 5  # steps
    max_iterations: int = 3  # gradient steps per solve
    inner_iterations: int = 8  # of the garment's linear solve; 1 is the paper's scheme
    max_speed: float = 0.12  # of a gripper, m/s
    weights: Weights = field(default_factory=Weights)
    progress_step: float = 0.08  # advance of s asked for per step (k)
    approach_distance: float = 0.20  # cap of l_h, m
    waiting_progress: float = 0.3  # least s of a waiting sleeve
    force_limit: float | None = None  # deprecated, N: is safety.force_limit now


@dataclass
class Local:
    """The local controller; see models/control/local_model.py."""

    period: float = 0.02  # between solves, s
    delay: float = 0.002  # from what is seen to the use of the solution, s
    time_step: float = 0.05  # of the problem, s
    horizon: int = 20  # steps
    position: float = 1.0  # weight of sleeves
    speed: float = 0.1  # weight of the grippers' speed, s²/m² of a step
    max_speed: float = 0.12  # of a gripper, m/s
    stretch: float = 1.0  # share of the distances that the garment reaches, that is used
    beside: float = 0.04  # that a dressed sleeve may be beside its target, m
    beside_speed: float = 0.05  # that it may move beside its arm, m/s
    dragged: float = 0.04  # how far a hand is taken to be pushed by the garment, m
    # share of what a sleeve is off from where the plan foresaw it, that is made up for:
    prepare_correction: float = 0.0  # while it is prepared
    dress_correction: float = 1.0  # while it is drawn on
    feedback: bool = True  # corrects between solves by the solution's gains
    solver: str = "constrained_ddp"  # or cone: Clarabel, exact and slower


@dataclass
class Controller:
    """What the controllers believe and how they act."""

    spacing: float = 0.04  # of the believed garment's mesh, m
    material: Material = field(default_factory=Material)
    method: str = "global"  # global plan alone, local compensation alone, or full: both
    global_mpc: GlobalMpc = field(default_factory=GlobalMpc)
    local: Local = field(default_factory=Local)
    # how the arms are believed to move on: still, or constant_velocity
    predictor: str = "still"
    command_rate: float = 100.0  # Hz


@dataclass
class Workspace:
    """A box in the world frame that the grippers' commands stay in; m."""

    low: list[float] = field(default_factory=list)  # x, y, z
    high: list[float] = field(default_factory=list)


@dataclass
class Safety:
    """Limits that no controller's request gets past; see models/control/safety.py."""

    max_speed: float = 0.25  # of a gripper's command, m/s
    max_acceleration: float = 2.0  # the same, m/s²
    max_braking: float = 6.0  # where the other limits need it; never exceeded, m/s²
    force_limit: float = 17.0  # no pulling from here on, N; beyond it grippers give way
    soft_force_limit: float | None = None  # pulling fades from here on, N; half of it if empty
    force_filter_time: float = 0.05  # of the force's low-pass, s
    yield_rate: float = 0.005  # speed of giving way per force beyond the limit, m/s/N
    yield_speed: float = 0.1  # of giving way, at most, m/s
    relax_speed: float = 0.02  # of giving way while stopped, m/s
    stop_time: float = 0.5  # beyond the force limit, after which both grippers stop, s
    max_lead: float = 0.02  # of a command before its gripper, m
    stale_time: float = 0.1  # age at which a request is not obeyed any more, s
    person_distance: float = 0.03  # of a gripper to the person's skin, m
    least_distance: float = 0.08  # between the grippers, m
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
    distance_behind: float = 0.85  # of the arms' bases behind the person, m
    spread: float = 1.0  # between them, m
    height_offset: float = -0.45  # of both, over the person's shoulders, m
    tilt_deg: float = 35.0  # of the hands, which point forward and this much down
    rate: float = 200.0  # of the joints' commands, Hz
    mode: str = "position_velocity"  # what is commanded: or position, or velocity alone


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
    stale_status: float = 0.05  # age at which arms hold, s
    stale_estimate: float = 0.2  # the same
    stale_camera: float = 0.5  # the same
    settle_time: float = 0.2  # for which all must be well before arms go on, s
    patience: float = 3.0  # with what is wrong, before the run ends, s
    wait: float = 10.0  # for the first messages, s
    start_distance: float = 0.02  # of a gripper from where the run begins, at most, m
    start_angle: float = 0.1  # of a joint, rad


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


@dataclass
class Variation:
    """What the seed draws, uniformly within ± these."""

    arm_angle_deg: float = 0.0  # on each arm's abduction, extension and elbow
    coat_scale: float = 0.0  # relative
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


EFFECT_SCHEMAS = {name: _effect_schema(effect) for name, effect in EFFECTS.items()}
# Physical effects by name, each with its parameters in SI units; see models/effects/. One that is
# not given is off.
Effects = dataclasses.make_dataclass(
    "Effects", [(n, t | None, field(default=None)) for n, t in EFFECT_SCHEMAS.items()]
)


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
    effects: Effects = field(default_factory=Effects)  # type: ignore[valid-type]


# What the lab reports of, beside its cameras.
_SOURCES = ("left_arm", "right_arm", "garment", "person")
# Words that a text may be (Drake's loader has no literal types).
_CHOICES = {
    "garment.coat.preset": ("overcoat", "jacket"),
    "garment.coat.grasp": ("patch", "seam"),
    "garment.mesh.unit": ("m", "cm", "mm"),
    "person.posture": ("standing", "sitting"),
    "person.behaviour.kind": ("dummy", "passive", "active"),
    **{
        f"person.behaviour.motions.{motion}.side": ("left", "right", "both")
        for motion in ("reach", "withdraw", "wave")
    },
    "controller.predictor": ("still", "constant_velocity"),
    "plant.integrator": ("implicit", "projective_dynamics"),
    "controller.method": ("full", "global", "local"),
    "controller.local.solver": ("constrained_ddp", "cone"),
    "station.kind": ("simulated", "hardware"),
    "lab.faults.kind": KINDS,
    "station.arms.model": ("floating", "panda"),
    "station.arms.mode": ("position_velocity", "position", "velocity"),
}

# Ranges by the end of the dotted key, both ends allowed; all other numbers must be finite.
_RANGES: dict[str, tuple[float, float]] = {
    "seed": (0, 2**63 - 1),
    "duration": (0.1, 600.0),
    "arms.distance_behind": (-5.0, 5.0),
    "arms.spread": (0.0, 5.0),
    "arms.height_offset": (-2.0, 2.0),
    "arms.tilt_deg": (-180.0, 180.0),
    "arms.rate": (50.0, 1000.0),
    "hardware.status_rate": (20.0, 1000.0),
    "hardware.estimate_rate": (1.0, 200.0),
    "hardware.stale_status": (0.01, 1.0),
    "hardware.stale_estimate": (0.02, 5.0),
    "hardware.stale_camera": (0.05, 10.0),
    "hardware.settle_time": (0.0, 10.0),
    "hardware.patience": (0.0, 60.0),
    "hardware.wait": (0.1, 3600.0),
    "hardware.start_distance": (0.0, 0.2),
    "hardware.start_angle": (0.0, 1.0),
    "lab.stale_command": (0.01, 1.0),
    "lab.wait": (0.1, 3600.0),
    "lab.rest": (0.0, 60.0),
    "lab.push": (0.0, 200.0),
    "cameras.width": (16, 4096),
    "cameras.height": (16, 4096),
    "cameras.fov_deg": (5.0, 150.0),
    "cameras.rate": (0.5, 60.0),
    "lab.faults.start": (0.0, 1e4),
    "lab.faults.duration": (0.0, 1e4),
    "coat.scale": (0.7, 1.4),
    "material.surface_density": (0.01, 5.0),
    "material.stretch_stiffness": (1.0, 1e5),
    "material.bending_stiffness": (0.0, 1.0),
    "material.damping": (0.0, 1.0),
    "material.friction": (0.0, 2.0),
    "material.margin": (0.0, 0.02),
    "plant.spacing": (0.01, 0.06),
    "controller.spacing": (0.01, 0.06),
    "plant.time_step": (1e-4, 0.05),
    "plant.iterations": (1, 1000),
    "plant.tolerance": (1e-10, 0.5),
    "shoulder_stiffness": (0.0, 1000.0),
    "shoulder_damping": (0.0, 1000.0),
    "elbow_stiffness": (0.0, 1000.0),
    "elbow_damping": (0.0, 1000.0),
    "abduction_deg": (-30.0, 150.0),
    "extension_deg": (-150.0, 70.0),
    "rotation_deg": (-70.0, 70.0),
    "elbow_deg": (0.0, 140.0),
    "following.time_constant": (0.05, 1000.0),
    "following.threshold": (0.0, 100.0),
    "following.return_time_constant": (0.05, 1000.0),
    "following.max_speed": (0.01, 5.0),
    "behaviour.max_hand_speed": (0.01, 2.0),
    "behaviour.max_joint_speed": (0.01, 10.0),
    "reach.start": (0.0, 600.0),
    "reach.within": (0.01, 1.0),
    "reach.push": (0.0, 0.3),
    "turn.angle_deg": (-90.0, 90.0),
    "turn.start": (0.0, 600.0),
    "turn.duration": (0.1, 60.0),
    "withdraw.start": (0.0, 600.0),
    "withdraw.duration": (0.1, 600.0),
    "withdraw.distance": (0.01, 0.4),
    "wave.start": (0.0, 600.0),
    "wave.duration": (0.1, 600.0),
    "wave.amplitude": (0.001, 0.3),
    "wave.frequency": (0.1, 5.0),
    "tremor.amplitude": (0.0, 0.05),
    "tremor.frequency": (1.0, 15.0),
    "global_mpc.period": (0.05, 10.0),
    "global_mpc.delay": (0.001, 10.0),
    "global_mpc.time_step": (0.005, 2.0),
    "global_mpc.horizon": (1, 100),
    "global_mpc.max_iterations": (1, 1000),
    "global_mpc.inner_iterations": (1, 1000),
    "global_mpc.max_speed": (0.001, 1.0),
    "global_mpc.progress_step": (0.001, 1.0),
    "global_mpc.approach_distance": (0.0, 1.0),
    "global_mpc.waiting_progress": (0.05, 2.0),
    "global_mpc.force_limit": (1.0, 200.0),
    "local.period": (0.001, 1.0),
    "local.delay": (1e-4, 1.0),
    "local.time_step": (0.005, 1.0),
    "local.horizon": (1, 200),
    "local.position": (0.0, 1e6),
    "local.speed": (1e-6, 1e6),
    "local.max_speed": (0.001, 1.0),
    "local.stretch": (0.1, 1.0),
    "local.beside": (0.001, 1.0),
    "local.beside_speed": (0.001, 10.0),
    "weights.position": (0.0, 1e6),
    "weights.direction": (0.0, 1e6),
    "weights.speed": (0.0, 1e6),
    "weights.safety": (0.0, 1e6),
    "weights.free_force": (0.0, 1e3),
    "weights.separation": (0.0, 1e6),
    "weights.least_spread": (0.0, 1.0),
    "weights.entering_spread": (0.0, 1.0),
    "weights.clearance": (0.0, 1e6),
    "weights.free_clearance": (0.0, 1.0),
    "command_rate": (10.0, 1000.0),
    "safety.max_speed": (0.001, 2.0),
    "safety.max_acceleration": (0.01, 50.0),
    "safety.max_braking": (0.01, 100.0),
    "safety.force_limit": (1.0, 200.0),
    "safety.soft_force_limit": (0.0, 200.0),
    "safety.force_filter_time": (0.0, 1.0),
    "safety.yield_rate": (0.0, 0.1),
    "safety.yield_speed": (0.0, 1.0),
    "safety.relax_speed": (0.001, 0.2),
    "safety.stop_time": (0.0, 60.0),
    "safety.max_lead": (0.001, 0.2),
    "safety.stale_time": (0.005, 5.0),
    "safety.person_distance": (0.0, 0.3),
    "safety.least_distance": (0.0, 1.0),
    "safety.largest_distance": (0.05, 3.0),
    "gripper.max_speed": (0.001, 2.0),
    "gripper.max_acceleration": (0.01, 50.0),
    "start.distance_behind": (0.1, 2.0),
    "start.height_offset": (-1.0, 1.0),
    "start.lateral_offset": (-1.0, 1.0),
    "variation.arm_angle_deg": (0.0, 45.0),
    "variation.coat_scale": (0.0, 0.3),
    "variation.plant_stiffness": (0.0, 0.9),
    "variation.plant_friction": (0.0, 0.9),
    "variation.start_offset": (0.0, 0.3),
    "log.rate": (1.0, 250.0),
}
_MEASURE_RANGE = (0.005, 3.0)
_EFFECT_RANGES = {
    f"effects.{name}.{p.name}": (p.low, p.high)
    for name, effect in EFFECTS.items()
    for p in effect.parameters()
}


def load_scenario(
    path: str | Path, overrides: Sequence[str] = (), seed: int | None = None
) -> Scenario:
    """Returns the scenario in `path`, with `KEY=VALUE` overrides and seed applied.

    Raises:
        UserError: file, key or value cannot be used.
    """
    source = str(path)
    content = _read(Path(path))
    for item in overrides:
        key, separator, text = item.partition("=")
        if not separator or not key:
            raise UserError("--set", item, "expected KEY=VALUE, such as plant.spacing=0.015")
        _override(content, key, text)
    if seed is not None:
        content["seed"] = seed
    content = _check(source, "", content, Scenario)
    try:
        scenario: Scenario = yaml_load_typed(schema=Scenario, data=yaml.safe_dump(content))
    except (RuntimeError, ValueError, TypeError) as error:
        raise UserError(source, "", f"cannot be read: {error}") from error
    _check_ranges(source, "", scenario)
    _move_force_limit(source, content, scenario)
    _check_safety(source, scenario.safety, 1.0 / scenario.controller.command_rate)
    _check_behaviour(source, scenario.person.behaviour)
    mpc = scenario.controller.global_mpc
    if mpc.delay >= mpc.period:
        raise UserError(
            source,
            "controller.global_mpc.delay",
            f"is {mpc.delay} s, expected less than the period, {mpc.period} s",
        )
    local = scenario.controller.local
    if local.delay >= local.period:
        raise UserError(
            source,
            "controller.local.delay",
            f"is {local.delay} s, expected less than the period, {local.period} s",
        )
    _check_hardware(source, scenario.station)
    _check_cameras(source, scenario)
    steps = mpc.delay / mpc.time_step
    if abs(steps - round(steps)) > 1e-6 or round(steps) >= mpc.horizon:
        raise UserError(
            source,
            "controller.global_mpc.delay",
            f"is {mpc.delay} s, expected a multiple of time_step, {mpc.time_step} s, "
            "within the horizon",
        )
    return scenario


def resolved_yaml(scenario: Scenario) -> str:
    """Returns the whole scenario as YAML that loads to the same."""
    text: str = yaml_dump_typed(scenario)
    return text


def apply_variation(scenario: Scenario) -> Scenario:
    """Returns the scenario with what its seed draws written in and no variation left."""
    drawn: Scenario = yaml_load_typed(schema=Scenario, data=resolved_yaml(scenario))
    v, rng = scenario.variation, np.random.default_rng(scenario.seed)

    def draw(width: float) -> float:
        return float(width * rng.uniform(-1.0, 1.0))

    for arm in (drawn.person.left_arm, drawn.person.right_arm):
        arm.abduction_deg += draw(v.arm_angle_deg)
        arm.extension_deg += draw(v.arm_angle_deg)
        arm.elbow_deg = max(0.0, arm.elbow_deg + draw(v.arm_angle_deg))
    drawn.garment.coat.scale *= 1.0 + draw(v.coat_scale)
    stiffness = 1.0 + draw(v.plant_stiffness)
    drawn.plant.material.stretch_stiffness *= stiffness
    drawn.plant.material.bending_stiffness *= stiffness
    drawn.plant.material.friction *= 1.0 + draw(v.plant_friction)
    drawn.station.start.distance_behind += draw(v.start_offset)
    drawn.station.start.height_offset += draw(v.start_offset)
    drawn.station.start.lateral_offset += draw(v.start_offset)
    drawn.variation = Variation()
    return drawn


def _read(path: Path) -> dict[str, Any]:
    source = str(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise UserError(source, "", "no such file, expected a scenario in YAML") from None
    except IsADirectoryError:
        raise UserError(source, "", "is a directory, expected a scenario in YAML") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(source, "", f"cannot be read as text: {error}") from error
    try:
        content = yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"line {mark.line + 1}" if mark is not None else ""
        problem = getattr(error, "problem", None) or "not YAML"
        raise UserError(source, where, f"{problem}, expected YAML") from error
    if content is None:
        raise UserError(source, "", "is empty, expected a scenario in YAML")
    if not isinstance(content, dict):
        raise UserError(source, "", f"holds {_kind(content)}, expected keys with values")
    return content


def _override(content: dict[str, Any], key: str, text: str) -> None:
    """Writes the YAML value `text` at the dotted `key`."""
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError:
        raise UserError("--set", key, f"{text!r} is not a YAML value") from None
    *parents, last = key.split(".")
    schema: Any = Scenario
    place = content
    for depth, name in enumerate(parents):
        schema = _field_type("--set", ".".join(parents[:depth]), name, schema)
        if place.get(name) is None:
            place[name] = {}
        place = place[name]
        if not isinstance(place, dict):
            raise UserError("--set", key, f"{name} holds a value, expected keys below it")
    hint = _field_type("--set", ".".join(parents), last, schema)
    place[last] = _check("--set", key, value, hint)


def _field_type(source: str, key: str, name: Any, schema: Any) -> Any:
    """Returns the type of a dataclass's field, or says which names there are."""
    schema = _without_none(schema)
    dotted = f"{key}.{name}" if key else str(name)
    if not dataclasses.is_dataclass(schema):
        raise UserError(source, dotted, "unknown key, expected none below a value")
    hints = typing.get_type_hints(schema)
    if name not in hints:
        near = difflib.get_close_matches(str(name), hints, n=1)
        expected = f"did you mean {near[0]}?" if near else f"expected one of {', '.join(hints)}"
        raise UserError(source, dotted, f"unknown key, {expected}")
    return hints[name]


def _check(source: str, key: str, value: Any, schema: Any) -> Any:
    """Holds a value read from YAML against a type; returns it, numbers as numbers."""
    origin = typing.get_origin(schema)
    if origin in (typing.Union, types.UnionType):
        if value is None:
            return None
        schema = _without_none(schema)
        origin = typing.get_origin(schema)
    if dataclasses.is_dataclass(schema):
        if not isinstance(value, dict):
            raise UserError(source, key, f"is {_kind(value)}, expected keys with values")
        inner = {name: _field_type(source, key, name, schema) for name in value}
        return {
            name: _check(source, f"{key}.{name}" if key else str(name), item, inner[name])
            for name, item in value.items()
        }
    if origin is dict:
        if not isinstance(value, dict):
            raise UserError(source, key, f"is {_kind(value)}, expected names with lists")
        below = typing.get_args(schema)[1]
        return {name: _check(source, f"{key}.{name}", v, below) for name, v in value.items()}
    if origin is list:
        if not isinstance(value, list):
            raise UserError(source, key, f"is {_kind(value)}, expected a list")
        below = typing.get_args(schema)[0]
        return [_check(source, f"{key}[{i}]", item, below) for i, item in enumerate(value)]
    if schema is float:
        if isinstance(value, str):
            # YAML 1.1 takes 1e9 for text
            try:
                return float(value)
            except ValueError:
                pass
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise UserError(source, key, f"is {_kind(value)}, expected a number")
    elif schema is int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise UserError(source, key, f"is {_kind(value)}, expected a whole number")
    elif schema is str:
        choices = _CHOICES.get(re.sub(r"\[\d+\]", "", key))
        if choices is not None and value not in choices:
            raise UserError(source, key, f"is {_kind(value)}, expected {' or '.join(choices)}")
        if not isinstance(value, str):
            raise UserError(source, key, f"is {_kind(value)}, expected text")
    return value


def _check_ranges(source: str, key: str, value: Any) -> None:
    if dataclasses.is_dataclass(value):
        for entry in dataclasses.fields(value):
            inner = f"{key}.{entry.name}" if key else entry.name
            _check_ranges(source, inner, getattr(value, entry.name))
    elif isinstance(value, list):
        for i, item in enumerate(value):
            _check_ranges(source, f"{key}[{i}]", item)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        if not math.isfinite(value):
            raise UserError(source, key, f"is {value}, expected a finite number")
        plain = re.sub(r"\[\d+\]", "", key)
        bounds = next(
            (r for end, r in _RANGES.items() if plain == end or plain.endswith("." + end)),
            _MEASURE_RANGE if ".measures." in key else _EFFECT_RANGES.get(key),
        )
        if bounds is not None and not bounds[0] <= value <= bounds[1]:
            raise UserError(source, key, f"is {value}, expected {bounds[0]:g} to {bounds[1]:g}")


def _move_force_limit(source: str, content: dict[str, Any], scenario: Scenario) -> None:
    """Takes the limit from where it stood before there was a group `safety`."""
    mpc = scenario.controller.global_mpc
    if mpc.force_limit is None:
        return
    if "force_limit" in content.get("safety", {}):
        raise UserError(
            source,
            "controller.global_mpc.force_limit",
            f"is {mpc.force_limit} N beside safety.force_limit, "
            "expected the latter alone: this key is its old name",
        )
    scenario.safety.force_limit, mpc.force_limit = mpc.force_limit, None


def _check_safety(source: str, safety: Safety, command_period: float) -> None:
    """Holds limits against each other."""
    soft, least = safety.soft_force_limit, safety.least_distance
    if soft is not None and soft >= safety.force_limit:
        raise UserError(
            source,
            "safety.soft_force_limit",
            f"is {soft} N, expected less than force_limit, {safety.force_limit} N",
        )
    if safety.max_braking < safety.max_acceleration:
        raise UserError(
            source,
            "safety.max_braking",
            f"is {safety.max_braking} m/s², expected max_acceleration, "
            f"{safety.max_acceleration} m/s², at least",
        )
    if safety.largest_distance is not None and safety.largest_distance <= least:
        raise UserError(
            source,
            "safety.largest_distance",
            f"is {safety.largest_distance} m, expected more than least_distance, {least} m",
        )
    if safety.stale_time < command_period:
        raise UserError(
            source,
            "safety.stale_time",
            f"is {safety.stale_time} s, expected a period of the commands, "
            f"{command_period:g} s, at least",
        )
    if safety.workspace is not None:
        corners = {"low": safety.workspace.low, "high": safety.workspace.high}
        for name, corner in corners.items():
            if len(corner) != 3 or not all(math.isfinite(x) for x in corner):
                raise UserError(
                    source, f"safety.workspace.{name}", f"is {corner}, expected x, y, z in m"
                )
        if not all(low < high for low, high in zip(*corners.values(), strict=True)):
            raise UserError(
                source,
                "safety.workspace.high",
                f"is {corners['high']}, expected more than low, {corners['low']}, on each axis",
            )


def _check_hardware(source: str, station: Station) -> None:
    if station.kind == "hardware" and station.arms.model != "panda":
        raise UserError(
            source,
            "station.arms.model",
            f"is {station.arms.model}, expected panda with station.kind: hardware",
        )
    url = station.hardware.lcm_url
    if not url.startswith(("udpm://", "memq://")):
        raise UserError(
            source,
            "station.hardware.lcm_url",
            f"is {url!r}, expected udpm://ADDRESS:PORT?ttl=0",
        )


def _check_cameras(source: str, scenario: Scenario) -> None:
    """Holds cameras, and what faults name, against each other."""
    names: set[str] = set()
    for i, camera in enumerate(scenario.station.cameras):
        key = f"station.cameras[{i}]"
        if not re.fullmatch(r"[a-z][a-z0-9_]*", camera.name) or camera.name in names:
            raise UserError(
                source,
                f"{key}.name",
                f"is {camera.name!r}, expected a name of its own, such as front",
            )
        names.add(camera.name)
        for name in ("position", "target"):
            point = getattr(camera, name)
            if len(point) != 3 or not all(math.isfinite(x) for x in point):
                raise UserError(source, f"{key}.{name}", f"is {point}, expected x, y, z in m")
        ahead = [t - p for t, p in zip(camera.target, camera.position, strict=True)]
        if math.hypot(ahead[0], ahead[1]) < 1e-3:
            raise UserError(
                source, f"{key}.target", "is straight above or below, expected it to the side"
            )
    sources = [*_SOURCES, *(f"camera_{name}" for name in sorted(names))]
    for i, fault in enumerate(scenario.lab.faults):
        if fault.source not in sources:
            raise UserError(
                source,
                f"lab.faults[{i}].source",
                f"is {fault.source!r}, expected {' or '.join(sources)}",
            )


def _check_behaviour(source: str, behaviour: Behaviour) -> None:
    """Holds the motions against each other and against the kind of person."""
    key = "person.behaviour.motions"
    if behaviour.motions and behaviour.kind != "active":
        raise UserError(
            source, key, f"are given to a {behaviour.kind} person, expected kind: active"
        )
    names = [entry.name for entry in dataclasses.fields(Motion)]
    reaching: set[str] = set()
    for i, motion in enumerate(behaviour.motions):
        given = [name for name in names if getattr(motion, name) is not None]
        if len(given) != 1:
            came = " and ".join(given) or "nothing"
            raise UserError(
                source, f"{key}[{i}]", f"is {came}, expected just one of {', '.join(names)}"
            )
        _check_speed(source, f"{key}[{i}]", motion, behaviour.max_hand_speed)
        if motion.reach is not None:
            side = motion.reach.side
            sides = {"left", "right"} if side == "both" else {side}
            if sides & reaching:
                raise UserError(
                    source,
                    f"{key}[{i}].reach.side",
                    f"is {side}, expected one reach for each hand",
                )
            reaching |= sides


def _check_speed(source: str, key: str, motion: Motion, max_hand_speed: float) -> None:
    if motion.turn is not None:
        turn = motions.Turn(
            angle=math.radians(motion.turn.angle_deg), duration=motion.turn.duration
        )
        if turn.speed > motions.FASTEST_TURN:
            raise UserError(
                source,
                f"{key}.turn.duration",
                f"is {turn.duration} s, a turn at up to {turn.speed:.2g} rad/s, "
                f"expected at most {motions.FASTEST_TURN} rad/s",
            )
    if motion.wave is not None:
        w = motion.wave
        wave = motions.Wave(duration=w.duration, amplitude=w.amplitude, frequency=w.frequency)
        if wave.speed > max_hand_speed:
            raise UserError(
                source,
                f"{key}.wave",
                f"moves the hand at up to {wave.speed:.2g} m/s, "
                f"expected at most max_hand_speed, {max_hand_speed:g} m/s",
            )


def _without_none(schema: Any) -> Any:
    if typing.get_origin(schema) in (typing.Union, types.UnionType):
        return next(t for t in typing.get_args(schema) if t is not type(None))
    return schema


def _kind(value: Any) -> str:
    if value is None:
        return "empty"
    if isinstance(value, dict):
        return "a group of keys"
    if isinstance(value, list):
        return "a list"
    return repr(value)
