"""The keys of a scenario's YAML: plain dataclasses that Drake's `yaml_load_typed` fills.

If a model also has a setting, its default is the model's. Groups that equal a model's settings
mirror them, and others refer to them. `tests/diagrams/test_defaults.py` compares both.

The docstring of each group describes its keys. `key_table.py` makes the table of all keys from
it. The first sentence of an entry ends with the unit: "greatest speed of a gripper, m/s."
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from drake_dress.diagrams.scenario.fidelity import FIDELITIES
from drake_dress.diagrams.scenario.mirror import Mirror, mirror_of
from drake_dress.models.arm import resolved_rate
from drake_dress.models.arm.status_check import JointBounds
from drake_dress.models.cloth import material
from drake_dress.models.control import (
    costs,
    insertion_search,
    local_model,
    policy,
    safety,
    task_parameters,
)
from drake_dress.models.control.own_costs import COSTS
from drake_dress.models.dressing import finish, stages
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.models.garment.mesh_options import MeshOptions
from drake_dress.models.human import (
    following,
    lowering,
    measures,
    motions,
    prediction,
    stirring,
    tremor,
    wheelchair,
)
from drake_dress.models.human.active import ActiveParameters
from drake_dress.models.human.girths import ARM_GIRTHS, GIRTHS
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.human.skin.phenotype import Phenotype
from drake_dress.models.human.spasm import SpasmParameters
from drake_dress.models.perception import (
    camera_errors,
    correction,
    garment_filter,
    pulls,
    segmentation_errors,
    stereo_errors,
    surface_points,
)
from drake_dress.models.supervision.garment_belief import GarmentBounds
from drake_dress.models.supervision.garment_shape import ShapeBounds
from drake_dress.models.supervision.person_belief import PersonBounds
from drake_dress.models.supervision.person_pose import PoseBounds
from drake_dress.models.supervision.supervision import Patience

# Values by name, then by parameter, of a section that users can extend; see `SCHEMAS`.
ValuesByName = dict[str, dict[str, float]]

_STANDARD = FIDELITIES["standard"]
_POLICY = policy.PolicyParameters()
_LOCAL = local_model.LocalParameters
_SAFETY = safety.SafetyLimits


@dataclass
class Coat:
    """A parametric coat: a preset whose single measures may be replaced.

    Attributes:
        preset: cut that supplies the measures that are not given.
        size: size that the cut is made in: a letter from XS to 5XL, an EU number from 34 to 60, or
            a child's stature from 92 to 176, cm (`docs/coats.md`). Given measures replace its own.
            If empty, the cut as it is drawn, for a man of size 50.
        size_table: who the size is for, `women`, `men` or `children`.
        scale: factor on all lengths, including given ones.
        body_length: length from the shoulder tips to the hem, m. If empty, the preset's value; the
            same holds for all measures below.
        chest: chest girth, m.
        shoulder_width: distance between the shoulder tips, m.
        sleeve_length: length from shoulder tip to cuff, m.
        armhole_girth: girth of each armhole, m.
        cuff_girth: girth of each cuff, m.
        collar_height: height of the collar, m.
        neck_width: distance between the inner ends of the shoulder seams, m.
        shoulder_slope: height of a shoulder seam's inner end above its outer end, m.
        front_opening: gap between the front edges, part of the chest girth, m. For a coat that
            opens at the back, here and below the front means the open side.
        hem_girth: girth of the hem over the open front, m. If no preset or size gives it, the body
            is straight.
        hem_opening: gap between the front edges at the hem, m.
        elbow_girth: girth of each sleeve halfway along it, m. If no preset or size gives it, the
            sleeve tapers evenly.
        neck_depth: depth of the front neckline below the inner ends of the shoulder seams, m. If no
            preset gives it, the front edges end at the shoulder seams.
        nape_depth: depth of the neckline in the middle of the closed side, measured likewise, m.
        lapel_width: largest width of a lapel, or of a shawl collar in front, m.
        lapel_depth: depth of the lower end of lapels or shawl below the shoulder tips, m.
        vent_length: length of a slit from the hem up the middle of the closed side, m.
        hood_height: height of a hood above the nape, m.
        sleeve_slope_deg: slope of the sleeves below the horizontal at rest, deg. If no preset gives
            it, 58.
        collar: what is sewn to the neckline, `stand`, `none`, `lapel`, `shawl` or `hood`. If empty,
            the preset's.
        opens: side on which the coat is open, `front` or `back`. If empty, the preset's.
        grasp: part of the coat that each gripper holds. `patch` is a patch 7 cm across with at
            least four nodes; `seam` is the whole shoulder seam, as on a hanger.
    """

    preset: str = "overcoat"
    size: str | None = None
    size_table: str = "men"
    scale: float = 1.0
    body_length: float | None = None
    chest: float | None = None
    shoulder_width: float | None = None
    sleeve_length: float | None = None
    armhole_girth: float | None = None
    cuff_girth: float | None = None
    collar_height: float | None = None
    neck_width: float | None = None
    shoulder_slope: float | None = None
    front_opening: float | None = None
    hem_girth: float | None = None
    hem_opening: float | None = None
    elbow_girth: float | None = None
    neck_depth: float | None = None
    nape_depth: float | None = None
    lapel_width: float | None = None
    lapel_depth: float | None = None
    vent_length: float | None = None
    hood_height: float | None = None
    sleeve_slope_deg: float | None = None
    collar: str | None = None
    opens: str | None = None
    grasp: str = "patch"


@dataclass
class Mesh:
    """A user's own garment, which replaces the coat.

    Attributes:
        file: OBJ, PLY, STL or glTF file, or a sewing pattern in GarmentCode's JSON format, relative
            to the scenario.
        unit: unit of the file's coordinates.
        scale: factor on all coordinates, in addition to the unit.
        up: axis of the file that points up; a minus sign is for files that are upside down.
        facing: axis of the file that the garment faces. By default x with z up, z with y up, y with
            x up.
        weld: distance across which edges of seams are joined, m. With 0 only nodes at the same
            position are merged.
        front: front edges that coincide from neck to hem, such as a closed zip: `auto` and `open`
            keep them apart, `closed` sews them. With `open` the garment must be open.
        rest: rest shape of the cloth. `mesh`: that of the file. `uv`: the size that it has in the
            texture coordinates, where these are its flat pattern; meshes come draped on a body.
            `auto`: `uv` where it can be, else `mesh`.
        take: parts of the file that are the garment, if not all are: names of objects or groups,
            sizes such as `>0.5 m` of connected parts, or places such as `near (0.1, 0, 1.2) m`.
        leave_out: parts to omit, in the same words; `<0.05 m` omits smaller connected parts.
        loops: node indices in order around each opening, by the opening's name; or a place on it,
            such as `near (0.5, 0, 1.2) m`; or for an armhole a plane with point and normal,
            `plane (0.2, 0, 1.3) m, (1, 0, 0)`. Openings that are not given are detected.
        grasp: node indices that each gripper holds, by side. By default ten nodes near each
            shoulder tip.
    """

    file: str = ""
    unit: str = MeshOptions.unit
    scale: float = MeshOptions.scale
    up: str = MeshOptions.up
    facing: str | None = MeshOptions.facing
    weld: float = MeshOptions.weld
    front: str = MeshOptions.front
    rest: str = MeshOptions.rest
    take: list[str] = field(default_factory=list)
    leave_out: list[str] = field(default_factory=list)
    loops: dict[str, list[int] | str] = field(default_factory=dict)
    grasp: dict[str, list[int]] = field(default_factory=dict)


@dataclass
class Garment:
    """The garment's pattern. Plant and controller each mesh it at their own spacing.

    Attributes:
        coat: parametric coat.
        mesh: garment from a file; it replaces the coat. A scenario file gives one of both.
        hold: where the grippers hold it. `shoulders`: as `coat.grasp` or `mesh.grasp` say. `edges`:
            at both edges of its opening, which they spread, as people hold a coat for others. The
            armholes then lie open before the person, however wide the panels between are.
        hold_depth: with `edges`, depth of the held points below the shoulder tips, as a share of
            the armholes' height.
    """

    coat: Coat = field(default_factory=Coat)
    mesh: Mesh | None = None
    hold: str = "shoulders"
    hold_depth: float = 0.4


@dataclass
class Material:
    """A fabric; see models/cloth/material.py.

    Attributes:
        surface_density: mass per rest area, kg/m².
        stretch_stiffness: tension per unit strain and width, N/m.
        bending_stiffness: moment per unit curvature and width, N·m.
        damping: stiffness-proportional damping time of the plant's implicit integrator, s.
        friction: Coulomb coefficient of cloth on skin.
        margin: distance kept between a node and the skin, m.
    """

    surface_density: float = material.Material.surface_density
    stretch_stiffness: float = material.Material.stretch_stiffness
    bending_stiffness: float = material.Material.bending_stiffness
    damping: float = 0.003
    friction: float = material.Material.friction
    margin: float = material.Material.margin


@mirror_of(measures.BodyMeasures, without=("left", "right"), lengths=GIRTHS)
class Measures(Mirror):
    """Body sizes, m, and masses, kg; see models/human/measures.py.

    Attributes:
        upper_arm_girth: girth of the upper arm instead of its radius, m.
        elbow_girth: girth of the arm above the elbow instead of its radius, m.
        forearm_girth: girth of the forearm below the elbow instead of its radius, m.
        wrist_girth: girth of the wrist instead of its radius, m.
        hand_girth: girth of the hand instead of its radius, m.
        neck_girth: girth of the neck below the head instead of its radius, m.
        neck_base_girth: girth of the neck at the shoulders instead of its radius, m.
        head_girth: girth of the head instead of its radius, m.
        thigh_girth: girth of the thigh instead of its radius, m.
        knee_girth: girth of the knee instead of its radius, m.
        ankle_girth: girth of the ankle instead of its radius, m.
        chest_girth: girth of the chest instead of its width, m. Without chest_depth, that is 0.625
            of the width.
        waist_girth: girth of the waist instead of its width, m. Without waist_depth, that is 0.73
            of the width.
        hip_girth: girth of the hips instead of their width, m. Without hip_depth, that is 0.7 of
            the width.
    """


@mirror_of(measures.ArmMeasures, lengths=ARM_GIRTHS)
class SideMeasures(Mirror):
    """Sizes of one arm, m, and masses, kg, where they differ from `person.measures`.

    Attributes:
        upper_arm_girth: girth of the upper arm instead of its radius, m.
        elbow_girth: girth of the arm above the elbow instead of its radius, m.
        forearm_girth: girth of the forearm below the elbow instead of its radius, m.
        wrist_girth: girth of the wrist instead of its radius, m.
        hand_girth: girth of the hand instead of its radius, m.
    """


@dataclass
class Arm:
    """Rest pose of an arm. With all angles zero it hangs straight down.

    Attributes:
        abduction_deg: sideways elevation, degrees.
        extension_deg: backward extension, degrees.
        rotation_deg: rotation about the arm's own axis, degrees.
        elbow_deg: elbow flexion, degrees.
    """

    abduction_deg: float = 13.0
    extension_deg: float = 46.0
    rotation_deg: float = 0.0
    elbow_deg: float = 10.0


@dataclass
class Joints:
    """Springs, dampers and limits of the person's arm joints.

    Attributes:
        shoulder_stiffness: stiffness of each shoulder joint, N·m/rad.
        shoulder_damping: damping of each shoulder joint, N·m·s/rad.
        elbow_stiffness: stiffness of the elbow, N·m/rad.
        elbow_damping: damping of the elbow, N·m·s/rad.
        abduction_limits_deg: smallest and largest sideways elevation, degrees. If empty, -0.6 to
            2.6 rad, that is -34 to 149 degrees.
        extension_limits_deg: smallest and largest backward extension, degrees. If empty, -2.6 to
            1.2 rad, that is -149 to 69 degrees.
        rotation_limits_deg: smallest and largest rotation about the arm's own axis, degrees. If
            empty, -1.2 to 1.2 rad, that is -69 to 69 degrees.
        elbow_limits_deg: smallest and largest elbow flexion, degrees. If empty, 0 to 2.5 rad, that
            is 0 to 143 degrees.
        tone: share of the arms' weight that their muscles carry, 0 to 1. With less than 1 an arm
            rests lower than its pose; at 0 it is paralysed and has no motion of its own.
    """

    shoulder_stiffness: float = JointParameters.shoulder_stiffness
    shoulder_damping: float = JointParameters.shoulder_damping
    elbow_stiffness: float = JointParameters.elbow_stiffness
    elbow_damping: float = JointParameters.elbow_damping
    abduction_limits_deg: list[float] | None = None
    extension_limits_deg: list[float] | None = None
    rotation_limits_deg: list[float] | None = None
    elbow_limits_deg: list[float] | None = None
    tone: float = JointParameters.tone


@dataclass
class SideJoints:
    """Springs, dampers, limits and tone of one arm, where they differ from `person.joints`.

    Attributes:
        shoulder_stiffness: stiffness of each shoulder joint, N·m/rad.
        shoulder_damping: damping of each shoulder joint, N·m·s/rad.
        elbow_stiffness: stiffness of the elbow, N·m/rad.
        elbow_damping: damping of the elbow, N·m·s/rad.
        abduction_limits_deg: smallest and largest sideways elevation, degrees.
        extension_limits_deg: smallest and largest backward extension, degrees.
        rotation_limits_deg: smallest and largest rotation about the arm's own axis, degrees.
        elbow_limits_deg: smallest and largest elbow flexion, degrees.
        tone: share of the arm's weight that its muscles carry; 0 for a paralysed arm.
    """

    shoulder_stiffness: float | None = None
    shoulder_damping: float | None = None
    elbow_stiffness: float | None = None
    elbow_damping: float | None = None
    abduction_limits_deg: list[float] | None = None
    extension_limits_deg: list[float] | None = None
    rotation_limits_deg: list[float] | None = None
    elbow_limits_deg: list[float] | None = None
    tone: float | None = None


@mirror_of(following.FollowingParameters)
class Following(Mirror):
    """How a person's arms follow the garment; see models/human/following.py."""


@dataclass
class Reach:
    """The hand reaches into the sleeve once the armhole is near.

    Attributes:
        side: hand that reaches.
        start: earliest time, s.
        within: distance from hand to armhole at which the reach begins, m.
        push: distance that the hand goes beyond the armhole before it follows the garment, m.
    """

    side: str = "both"
    start: float = motions.Reach.start
    within: float = motions.Reach.within
    push: float = motions.Reach.push


@dataclass
class Turn:
    """The body turns about the vertical axis and stays turned.

    Attributes:
        angle_deg: angle of the turn, leftward positive, degrees.
        start: time at which the turn begins, s.
        duration: duration of the turn, s.
    """

    angle_deg: float = 15.0
    start: float = 15.0
    duration: float = motions.Turn.duration


@dataclass
class Withdraw:
    """The hand withdraws to the side of the body for a while, then returns.

    Attributes:
        side: hand that withdraws.
        start: time at which the hand begins to withdraw, s.
        duration: time from the start until the hand begins to return, s.
        distance: horizontal distance of the withdrawal, m.
    """

    side: str = "both"
    start: float = 10.0
    duration: float = motions.Withdraw.duration
    distance: float = motions.Withdraw.distance


@dataclass
class Wave:
    """The hand swings sideways.

    Attributes:
        side: hand that waves.
        start: time at which the wave begins, s.
        duration: duration of the wave, s.
        amplitude: half of the swing's width, m.
        frequency: frequency of the wave, Hz.
    """

    side: str = "both"
    start: float = 10.0
    duration: float = motions.Wave.duration
    amplitude: float = motions.Wave.amplitude
    frequency: float = motions.Wave.frequency


@dataclass
class Motion:
    """One motion of an active person. Give exactly one of these.

    Attributes:
        reach: the hand reaches into the sleeve.
        turn: the body turns.
        withdraw: the hand withdraws for a while.
        wave: the hand swings sideways.
    """

    reach: Reach | None = None
    turn: Turn | None = None
    withdraw: Withdraw | None = None
    wave: Wave | None = None


@mirror_of(tremor.TremorParameters)
class Tremor(Mirror):
    """Tremor of both hands, 4 to 12 Hz and up to 2 cm; see models/human/tremor.py."""


@dataclass
class Spasm:
    """Spasms of an arm: it bends and is drawn to the body; see models/human/spasm.py.

    Attributes:
        side: arm that has them.
        torque: mean torque that bends the elbow, N·m.
        interval: mean time from one spasm to the next, s.
        duration: time for which a spasm has its full strength, s.
    """

    side: str = "right"
    torque: float = SpasmParameters.torque
    interval: float = SpasmParameters.interval
    duration: float = SpasmParameters.duration


@dataclass
class Lowering:
    """Both arms are lowered once both sleeves are on; see models/human/lowering.py.

    Attributes:
        abduction_deg: sideways elevation of the lowered arms, degrees.
        extension_deg: backward extension of the lowered arms, degrees.
        elbow_deg: elbow flexion of the lowered arms, degrees.
        duration: time that it takes, s. 0 keeps the arms where they are.
    """

    abduction_deg: float = 12.0
    extension_deg: float = 5.0
    elbow_deg: float = 15.0
    duration: float = lowering.Lowering.duration


@mirror_of(stirring.StirringParameters)
class Stirring(Mirror):
    """Small motions of both arms once the coat is let go; see models/human/stirring.py."""


@dataclass
class Behaviour:
    """The person's own motions. The controller does not know them.

    Attributes:
        kind: `dummy` has springs about the rest pose, `passive` follows the garment, `active`
            performs the listed motions and follows the garment between them.
        following: how a passive or active person follows the garment.
        motions: motions of an active person.
        max_hand_speed: greatest hand speed of the person's own motions, m/s.
        max_joint_speed: greatest joint speed of the person's own motions, rad/s.
        tremor: tremor of both hands; none if empty.
        spasm: spasms of an arm; none if empty.
        lowering: both arms are lowered once both sleeves are on; a dummy's arms by somebody.
        stirring: small motions of both arms once the coat is let go.
    """

    kind: str = "dummy"
    following: Following = field(default_factory=Following)
    motions: list[Motion] = field(default_factory=list)
    max_hand_speed: float = ActiveParameters.max_hand_speed
    max_joint_speed: float = ActiveParameters.max_joint_speed
    tremor: Tremor | None = None
    spasm: Spasm | None = None
    lowering: Lowering = field(default_factory=Lowering)
    stirring: Stirring = field(default_factory=Stirring)


@dataclass
class BodyScan:
    """A scan of the standing person; see models/human/skin/scan.py.

    Attributes:
        file: OBJ, PLY, STL or glTF file, relative to the scenario.
        unit: unit of the coordinates of the file and of the joints.
        up: axis of the file that points up.
        joints: x, y, z of the joints inside the body, in the file's coordinates, by name. Needed
            are `left_shoulder`, `left_elbow`, `left_hand` (its middle) and those of the right side.
            `wrist`, `hip`, `knee` and `ankle` of a side, `neck` and `head` (where the neck begins
            and ends) are estimated if not given.
    """

    file: str = ""
    unit: str = "m"
    up: str = "z"
    joints: dict[str, list[float]] = field(default_factory=dict)


@dataclass
class Body:
    """What the measures that are not given follow from: either `scan`, or all of the first four.

    Attributes:
        sex: sex of the parametric body.
        age: age of the person, years.
        height: stature without shoes, m.
        weight: body mass, kg.
        muscle: how muscular the body is at this weight. At the default, girths are nearest to the
            means of a survey.
        scan: scan of the person.
    """

    sex: str | None = None
    age: float | None = None
    height: float | None = None
    weight: float | None = None
    muscle: float = Phenotype.muscle
    scan: BodyScan | None = None


@mirror_of(wheelchair.Wheelchair)
class Chair(Mirror):
    """The wheelchair that the person sits in, sizes in m; see models/human/wheelchair.py."""


@dataclass
class Person:
    """The person who is dressed.

    Attributes:
        posture: standing or sitting.
        body: body that gives the measures that `measures` does not; none if empty.
        measures: body sizes.
        left_measures: sizes of the left arm that differ.
        right_measures: sizes of the right arm that differ.
        left_arm: rest pose of the left arm.
        right_arm: rest pose of the right arm.
        joints: springs, dampers and limits of the arm joints.
        left_joints: those of the left arm that differ.
        right_joints: those of the right arm that differ.
        behaviour: the person's own motions.
        chair: wheelchair of a sitting person; none if empty. `{}` is a chair of the person's size.
    """

    posture: str = "standing"
    body: Body | None = None
    measures: Measures = field(default_factory=Measures)
    left_measures: SideMeasures = field(default_factory=SideMeasures)
    right_measures: SideMeasures = field(default_factory=SideMeasures)
    left_arm: Arm = field(default_factory=Arm)
    right_arm: Arm = field(default_factory=Arm)
    joints: Joints = field(default_factory=Joints)
    left_joints: SideJoints = field(default_factory=SideJoints)
    right_joints: SideJoints = field(default_factory=SideJoints)
    behaviour: Behaviour = field(default_factory=Behaviour)
    chair: Chair | None = None


@dataclass
class Plant:
    """The simulated garment and person: the true state of a run.

    Attributes:
        fidelity: preset for spacing, time_step, body_time_step, implicitness, buckling_wavelength
            and tolerance if these are not given; see fidelity.py.
        spacing: edge length of the garment's mesh, m.
        time_step: time step of the garment, s.
        body_time_step: time step of robot arms, grippers and the person's joints, s.
        integrator: `implicit` is linearly implicit; `projective_dynamics` is solved to convergence
            and takes about thirty times as long; `mujoco` is the cloth and contact of MuJoCo, an
            extra, which takes its own solver settings (docs/transfer.md).
        implicitness: blend of the implicit integrator. 1 is implicit Euler, whose damping grows
            with the time step; values near 0.5 are second order and may jitter.
        buckling_wavelength: shortest wrinkle that the mesh can represent, in spacings. Compression
            that would buckle at shorter wavelengths is relaxed; 0 turns this off.
        iterations: iteration limit of the implicit integrator's linear solver.
        tolerance: relative residual at which the linear solver stops.
        self_collision: whether layers of the garment collide with each other.
        grasp_stiffness: stiffness of arm and grasp against a person who pushes the held cloth, N/m.
            The default is the translational stiffness of libfranka's impedance examples.
        material: fabric of the simulated garment.
    """

    fidelity: str = "standard"
    spacing: float = _STANDARD["spacing"]
    time_step: float = _STANDARD["time_step"]
    body_time_step: float = _STANDARD["body_time_step"]
    integrator: str = "implicit"
    implicitness: float = _STANDARD["implicitness"]
    buckling_wavelength: float = _STANDARD["buckling_wavelength"]
    iterations: int = 40
    tolerance: float = _STANDARD["tolerance"]
    self_collision: bool = True
    grasp_stiffness: float = 3000.0
    material: Material = field(default_factory=lambda: Material(stretch_stiffness=1500.0))


@mirror_of(costs.Weights)
class Weights(Mirror):
    """Weights of the global controller's costs; see models/control/costs.py."""


@mirror_of(task_parameters.Approach)
class Approach(Mirror):
    """A way to approach a hand; see models/control/task_parameters.py."""


@mirror_of(stages.StageParameters, without=("waiting_progress",))
class Stages(Mirror):
    """Thresholds between the stages of a dressing; see models/dressing/stages.py."""


@mirror_of(finish.FinishParameters)
class Finish(Mirror):
    """Laying the coat and letting it go; see models/dressing/finish.py."""


@mirror_of(insertion_search.InsertionParameters)
class Insertion(Mirror):
    """Search for a motion that puts the first hand in; see models/control/insertion_search.py."""


@mirror_of(task_parameters.TaskParameters, without=("progress_rate", "approach_distance", "stages"))
class Tasks(Mirror):
    """Targets of the sleeves; see models/control/task_parameters.py."""


@dataclass
class GlobalMpc:
    """The global controller: gradient descent on a plan through the controller's garment.

    Attributes:
        period: time between solves, s.
        delay: time from the observation to the use of the plan, s. A multiple of `time_step`, or
            `measured`: the shortest such delay that 95 % of the solves keep on this machine, as
            measured by `drake-dress bench delay`.
        time_step: time step of the prediction, s.
        horizon: number of prediction steps.
        max_iterations: gradient steps per solve, at most.
        budget: iterations of linear solves that one solve may use, of 0.1 to 0.2 ms each. When
            they are used up, the best plan so far is taken. Unlimited if empty. On hardware
            `delay_share` limits the time instead.
        delay_share: share of the delay that a solve may take on hardware.
        inner_iterations: iterations of the garment's linear solve per prediction step; 1 is the
            paper's scheme.
        max_speed: greatest planned speed of a gripper, m/s.
        weights: weights of the stage costs.
        progress_step: requested advance of the dressing coordinate s in each prediction step (k in
            the paper).
        approach_distance: upper bound of l_h, the distance before the hand at which a sleeve is
            prepared, m.
        waiting_progress: lowest s at which a sleeve waits for the other one.
        spread_share: share of the radius about a predicted joint, in which it is with probability
            0.9, by which the grippers keep further away from that limb. It acts only if the
            predictor tells radii.
        span_share: share of the way between both grasps over the cloth that the grippers may be
            apart. They may also be as far apart as the grasps are at rest.
        force_limit: old name of `safety.force_limit`, N. Deprecated.
    """

    period: float = 0.5
    delay: float = round(_POLICY.committed_steps * _POLICY.time_step, 9)
    time_step: float = _POLICY.time_step
    horizon: int = _POLICY.horizon
    max_iterations: int = _POLICY.max_iterations
    budget: int | None = _POLICY.budget.iterations
    delay_share: float = 0.9
    inner_iterations: int = _POLICY.inner_iterations
    max_speed: float = _POLICY.max_speed
    weights: Weights = field(default_factory=Weights)
    progress_step: float = round(_POLICY.tasks.progress_rate * _POLICY.time_step, 9)
    approach_distance: float = _POLICY.tasks.approach_distance
    waiting_progress: float = _POLICY.tasks.stages.waiting_progress
    spread_share: float = _POLICY.spread_share
    span_share: float = _POLICY.span_share
    force_limit: float | None = None


@dataclass
class Local:
    """The local controller; see models/control/local_model.py.

    Attributes:
        period: time between solves, s.
        delay: time from the observation to the use of the solution, s.
        time_step: time step of the problem, s.
        horizon: number of steps.
        position: weight of the sleeves' positions, 1/m².
        speed: weight of the change of the grippers' speeds, s²/m².
        max_speed: greatest speed of a gripper, m/s.
        stretch: usable share of the distances that the garment can span.
        beside: greatest lateral distance of a dressed sleeve from its arm, m.
        beside_speed: greatest lateral speed of a dressed sleeve, m/s.
        return_speed: speed at which violated bounds are restored without a plan, m/s.
        dragged: deviation of a hand from its predicted position that is attributed to the garment,
            m. Only a deviation beyond it is followed.
        prepare_correction: share of a sleeve's deviation from the plan that is corrected while the
            sleeve is prepared.
        dress_correction: share of the deviation that is corrected while the sleeve is drawn up the
            arm.
        taut_share: share of the garment's span from one gripper above which a sleeve also follows
            the other gripper.
        coupled_share: share of the span between the armholes above which the sleeves are coupled.
        released_share: share of that span below which the sleeves are decoupled again.
        feedback: whether the solution's feedback gains correct the command between solves.
        solver: `constrained_ddp`, or `cone`: Clarabel, which is exact and slower.
        prediction_step: time step of the prediction of the person's arms, s.
    """

    period: float = 0.02
    delay: float = 0.002
    time_step: float = _LOCAL.time_step
    horizon: int = _LOCAL.horizon
    position: float = _LOCAL.position
    speed: float = _LOCAL.speed
    max_speed: float = _LOCAL.max_speed
    stretch: float = _LOCAL.stretch
    beside: float = _LOCAL.beside
    beside_speed: float = _LOCAL.beside_speed
    return_speed: float = _LOCAL.return_speed
    dragged: float = _LOCAL.dragged
    prepare_correction: float = _LOCAL.prepare_correction
    dress_correction: float = _LOCAL.dress_correction
    taut_share: float = _LOCAL.taut_share
    coupled_share: float = _LOCAL.coupled_share
    released_share: float = _LOCAL.released_share
    feedback: bool = True
    solver: str = "constrained_ddp"
    prediction_step: float = 0.2


@mirror_of(prediction.ConstantVelocityPredictor)
class ConstantVelocity(Mirror):
    """The predictor `constant_velocity`; see models/human/prediction.py."""


@dataclass
class Controller:
    """The controllers and their assumptions.

    Attributes:
        spacing: edge length of the controller's garment mesh, m.
        material: fabric that the controller assumes.
        method: `global` uses the global plan alone, `local` the local controller alone, `full`
            both.
        global_mpc: the global controller.
        tasks: targets of the sleeves.
        stages: thresholds between the stages.
        insertion: search for the motion that puts the first hand into its sleeve.
        finish: laying the coat on the shoulders and letting it go.
        local: the local controller.
        predictor: how the person's arms are predicted to move.
        constant_velocity: settings of the predictor of that name.
        weights: folder of `drake-dress train`, relative to the scenario, with the weights of the
            predictors `learned`, `ridge` and `recurrent`. By default those of the package.
        costs: registered costs of the plan by name, each with its fields.
        command_rate: rate of the grippers' commands, Hz.
    """

    spacing: float = 0.05
    material: Material = field(default_factory=Material)
    method: str = "global"
    global_mpc: GlobalMpc = field(default_factory=GlobalMpc)
    tasks: Tasks = field(default_factory=Tasks)
    stages: Stages = field(default_factory=Stages)
    insertion: Insertion = field(default_factory=Insertion)
    finish: Finish = field(default_factory=Finish)
    local: Local = field(default_factory=Local)
    predictor: str = "still"
    constant_velocity: ConstantVelocity = field(default_factory=ConstantVelocity)
    weights: str | None = None
    costs: ValuesByName = field(default_factory=dict)
    command_rate: float = 100.0


@dataclass
class Workspace:
    """A box in the world frame that limits the grippers' commands.

    Attributes:
        low: lower corner x, y, z, m.
        high: upper corner x, y, z, m.
    """

    low: list[float] = field(default_factory=list)
    high: list[float] = field(default_factory=list)


@dataclass
class Safety:
    """Limits that the safety governor enforces; see models/control/safety.py.

    Attributes:
        max_speed: greatest speed of a gripper's command, m/s.
        max_acceleration: greatest ordinary acceleration of a command, m/s².
        max_braking: greatest acceleration where other limits need it; never exceeded, m/s².
        force_limit: force above which a gripper stops pulling and gives way, N.
        soft_force_limit: force above which the pulling speed is reduced, N. Half of `force_limit`
            if empty.
        force_filter_time: time constant of the force's low-pass filter, s.
        yield_rate: speed of giving way per newton beyond the limit, m/s/N.
        yield_speed: greatest speed of giving way, m/s.
        relax_speed: speed of giving way while stopped, m/s.
        stop_time: time beyond the force limit after which both grippers stop, s.
        max_lead: greatest distance of a command ahead of its gripper, m.
        stale_time: age above which a request is ignored, s.
        person_distance: smallest distance of a gripper from the person's skin, m.
        held_distance: smallest distance of the held cloth from the skin, m. A fold fits in between.
        least_distance: smallest distance between the grippers, m.
        largest_distance: greatest distance between the grippers, m. Unlimited if empty.
        workspace: box that limits the commands; unlimited if empty.
    """

    max_speed: float = _SAFETY.max_speed
    max_acceleration: float = _SAFETY.max_acceleration
    max_braking: float = _SAFETY.max_braking
    force_limit: float = _SAFETY.hard_force
    soft_force_limit: float | None = None
    force_filter_time: float = _SAFETY.filter_time
    yield_rate: float = _SAFETY.yield_rate
    yield_speed: float = _SAFETY.yield_speed
    relax_speed: float = _SAFETY.relax_speed
    stop_time: float = _SAFETY.stop_time
    max_lead: float = _SAFETY.max_lead
    stale_time: float = _SAFETY.stale_time
    person_distance: float = _SAFETY.person_distance
    held_distance: float = _SAFETY.held_distance
    least_distance: float = _SAFETY.least_distance
    largest_distance: float | None = None
    workspace: Workspace | None = None


@dataclass
class Gripper:
    """Limits of a floating gripper.

    Attributes:
        max_speed: greatest speed, m/s.
        max_acceleration: greatest acceleration, m/s².
    """

    max_speed: float = 0.25
    max_acceleration: float = 2.0


@dataclass
class Start:
    """Initial position of the garment, relative to the midpoint of the shoulders.

    Attributes:
        distance_behind: distance behind the person, or in front with `station.side: front`, m.
        height_offset: height above the shoulders, m.
        lateral_offset: offset to the person's left, m.
    """

    distance_behind: float = 0.75
    height_offset: float = 0.0
    lateral_offset: float = 0.0


@mirror_of(resolved_rate.RateParameters)
class ResolvedRate(Mirror):
    """Control of the arms' joints; see models/arm/resolved_rate.py."""


@dataclass
class Arms:
    """The arms that carry the grippers.

    Attributes:
        model: `floating` grippers, or two `panda` arms.
        distance_behind: distance of the arms' bases behind the person, or in front with
            `station.side: front`, m.
        spread: distance between the two bases, m.
        height_offset: height of both bases above the person's shoulders, m.
        tilt_deg: downward tilt of the hands, which point forward, degrees.
        rate: rate of the joint commands, Hz.
        mode: content of a joint command: position and velocity, or one of them.
        resolved_rate: control of the joints.
    """

    model: str = "floating"
    distance_behind: float = 0.7
    spread: float = 1.1
    height_offset: float = -0.25
    tilt_deg: float = 35.0
    rate: float = 200.0
    mode: str = "position_velocity"
    resolved_rate: ResolvedRate = field(default_factory=ResolvedRate)


@dataclass
class Beliefs:
    """Plausibility bounds on hardware messages. The arms hold if a message exceeds one.

    Attributes:
        joint_leap: joint motion between two arm messages beyond that at the speed limit, rad.
        torque_share: external torque on a joint, as a multiple of its torque limit.
        point_error: error of a reported point of the person, m. Body trackers reach 1 to 3 cm.
        limb_share: relative difference between real limbs and the scenario's measures.
        shoulder_distance: distance of the shoulders' midpoint from its position in the scenario, m.
        turn_deg: rotation of the shoulders about the vertical axis, degrees.
        joint_room_deg: angle by which a supple person's joints may exceed the limits, degrees.
        person_speed: speed of a point of the person, m/s. It allows a hand that is pulled back in
            alarm.
        frozen_time: time for which a noisy point may stay exactly the same, s. Real trackers have
            noise; 0 turns the check off.
        node_noise: standard deviation of a garment node on each axis, m. Depth cameras have 0.5 to
            1 cm.
        strain: strain of an edge of the garment. Coats stretch by 10 % in use, 20 % at most.
        least_edge: smallest root-mean-square edge length relative to rest; folds shorten edges.
        grasp_distance: distance of the held nodes' centre from their gripper, m.
        garment_speed: speed of a node between messages, m/s. A swinging hem reaches 1.7 m/s.
        garment_velocity: reported velocity of a node, including its noise, m/s.
        velocity_error: difference between reported velocities and the motion, m/s.
        frozen_travel: travel of a gripper while the garment stays exactly the same, m. 0 turns the
            check off.
    """

    joint_leap: float = JointBounds.leap
    torque_share: float = JointBounds.torque_share
    point_error: float = PoseBounds.point_error
    limb_share: float = PoseBounds.length_share
    shoulder_distance: float = PoseBounds.shoulder_distance
    turn_deg: float = math.degrees(PoseBounds.turn)
    joint_room_deg: float = math.degrees(PoseBounds.joint_room)
    person_speed: float = PersonBounds.speed
    frozen_time: float = PersonBounds.frozen_time
    node_noise: float = ShapeBounds.node_noise
    strain: float = ShapeBounds.strain
    least_edge: float = ShapeBounds.least_edge
    grasp_distance: float = ShapeBounds.grasp_distance
    garment_speed: float = GarmentBounds.speed
    garment_velocity: float = GarmentBounds.velocity
    velocity_error: float = GarmentBounds.velocity_error
    frozen_travel: float = GarmentBounds.frozen_travel


@dataclass
class Hardware:
    """The message bus of a hardware station, and of the lab of `drake-dress sim-station`.

    Attributes:
        lcm_url: address of the LCM bus. `ttl=0` keeps messages on this machine.
        status_channel: channel of the arms' status; `_LEFT` and `_RIGHT` are appended.
        command_channel: channel of the arms' commands; `_LEFT` and `_RIGHT` are appended.
        garment_channel: channel of the garment estimates.
        person_channel: channel of the person estimates.
        camera_channel: channel of the camera images; `_NAME` is appended.
        gripper_command_channel: channel of the commands to open the grippers; `_LEFT` and `_RIGHT`
            are appended.
        gripper_status_channel: channel of the grippers' status; `_LEFT` and `_RIGHT` are appended.
        cue_channel: channel of the cue to lower the arms, once both sleeves are on, or are past the
            elbows and one of them stalls.
        release: `confirm` asks before the grippers open, `automatic` does not.
        status_rate: rate of the lab's arm status, Hz.
        estimate_rate: rate of the lab's estimates, Hz.
        stale_status: age of an arm's status at which the arms hold, s. A late message that is older
            than the newest by no more than this is dropped.
        stale_estimate: age of an estimate at which the arms hold, s. Late messages are treated as
            for `stale_status`.
        stale_camera: age of an image at which the arms hold, s. Late messages are treated as for
            `stale_status`.
        settle_time: time for which every source must be sound before the arms move on, s.
        patience: time that a fault may last before the run ends, s.
        wait: time to wait for the first messages, s.
        start_distance: greatest distance of a gripper from its start, m.
        start_angle: greatest deviation of a joint from its start, rad.
        beliefs: plausibility bounds on messages.
    """

    lcm_url: str = "udpm://239.255.76.67:7667?ttl=0"
    status_channel: str = "PANDA_STATUS"
    command_channel: str = "PANDA_COMMAND"
    garment_channel: str = "GARMENT_ESTIMATE"
    person_channel: str = "PERSON_ESTIMATE"
    camera_channel: str = "CAMERA"
    gripper_command_channel: str = "GRIPPER_COMMAND"
    gripper_status_channel: str = "GRIPPER_STATUS"
    cue_channel: str = "PERSON_CUE"
    release: str = "confirm"
    status_rate: float = 200.0
    estimate_rate: float = 50.0
    stale_status: float = 0.05
    stale_estimate: float = 0.2
    stale_camera: float = 0.5
    settle_time: float = Patience.settle_time
    patience: float = Patience.fault
    wait: float = 10.0
    start_distance: float = 0.02
    start_angle: float = 0.1
    beliefs: Beliefs = field(default_factory=Beliefs)


@dataclass
class Camera:
    """A colour and depth camera; world frame.

    Attributes:
        name: name of the camera, in lower case.
        position: position x, y, z, m.
        target: point in the centre of the image x, y, z, m.
        width: width of the image, pixels.
        height: height of the image, pixels.
        fov_deg: vertical field of view, degrees.
        rate: image rate, Hz.
    """

    name: str = ""
    position: list[float] = field(default_factory=list)
    target: list[float] = field(default_factory=list)
    width: int = 320
    height: int = 240
    fov_deg: float = 60.0
    rate: float = 5.0


@mirror_of(stereo_errors.StereoErrors)
class StereoErrors(Mirror):
    """Errors of depth; see models/perception/stereo_errors.py."""


@mirror_of(segmentation_errors.SegmentationErrors)
class SegmentationErrors(Mirror):
    """Errors of labels; see models/perception/segmentation_errors.py."""


@mirror_of(camera_errors.CameraErrors)
class CameraErrors(Mirror):
    """Errors of cameras that controllers see with; see models/perception/camera_errors.py."""


@dataclass
class Station:
    """The robots, or their simulation.

    Attributes:
        kind: `simulated`, or `hardware`, which has the same ports behind LCM messages.
        side: where garment and robots are: `behind` the person, who holds the arms back, or in
            `front`, where the person reaches forward into a garment that opens at the back.
        arms: the arms that carry the grippers.
        hardware: message bus.
        gripper: limits of floating grippers.
        start: initial position of the coat.
        cameras: cameras of the station.
        camera_errors: errors of depth, labels, time and pose of simulated cameras. They act where
            controllers see with cameras (`perception.kind`).
    """

    kind: str = "simulated"
    side: str = "behind"
    arms: Arms = field(default_factory=Arms)
    hardware: Hardware = field(default_factory=Hardware)
    gripper: Gripper = field(default_factory=Gripper)
    start: Start = field(default_factory=Start)
    cameras: list[Camera] = field(default_factory=list)
    camera_errors: CameraErrors = field(default_factory=CameraErrors)


@mirror_of(surface_points.PointSettings)
class Points(Mirror):
    """Points of depth images that are used; see models/perception/surface_points.py."""


@mirror_of(pulls.PullSettings)
class Pulls(Mirror):
    """What images ask of the garment; see models/perception/pulls.py."""


@mirror_of(correction.CorrectionSettings)
class Correction(Mirror):
    """How far images move the garment; see models/perception/correction.py."""


@mirror_of(garment_filter.FilterSettings)
class Filter(Mirror):
    """Prediction and correction of the garment; see models/perception/garment_filter.py."""


@dataclass
class Perception:
    """How controllers see the garment.

    Attributes:
        kind: `oracle` knows where the garment is; `cameras` tracks it in the depth images of the
            station's cameras.
        spacing: edge length of the tracked garment's mesh, m. It needs nearly that of the plant:
            with 5 cm folds are lost, and errors double.
        material: fabric that is assumed of it. The controller's own is softer than cloth.
        period: time between estimates, s; a multiple of `filter.time_step`.
        delay: modelled time that an estimate takes, s, less than `period`.
        memory: longest age of images that are still used, s.
        filter: prediction and correction of the garment.
    """

    kind: str = "oracle"
    spacing: float = 0.03
    material: Material = field(
        default_factory=lambda: Material(stretch_stiffness=800.0, damping=0.01)
    )
    period: float = 0.1
    delay: float = 0.08
    memory: float = 0.5
    filter: Filter = field(default_factory=Filter)


@dataclass
class LabFault:
    """A fault in the lab of `drake-dress sim-station`.

    Attributes:
        kind: kind of the fault; see models/supervision/injection.py.
        source: faulty source: `left_arm`, `right_arm`, `garment`, `person` or `camera_NAME`. A lost
            bus affects all.
        start: time after the first command, s.
        duration: duration of the fault, s.
    """

    kind: str = "stale"
    source: str = "left_arm"
    start: float = 5.0
    duration: float = 1.0


@dataclass
class Lab:
    """The lab of `drake-dress sim-station`. A run does not use these keys.

    Attributes:
        faults: faults to inject.
        stale_command: age of commands at which the arms stop by themselves, s.
        wait: time to wait for the first command, s.
        rest: time from the last command until the lab closes, s.
        push: force of a fault of kind `push`, N.
        person_noise: standard deviation of the person's reported points on each axis, m. No real
            tracker repeats itself exactly.
    """

    faults: list[LabFault] = field(default_factory=list)
    stale_command: float = 0.1
    wait: float = 300.0
    rest: float = 3.0
    push: float = 60.0
    person_noise: float = 1e-4


@dataclass
class Variation:
    """Quantities that the seed draws: numbers uniformly within plus or minus these widths.

    Attributes:
        arm_angle_deg: width on abduction, extension and elbow of each arm, degrees.
        coat_scale: relative width on all lengths of the garment at once.
        coat_measures: relative width on each measure of the coat independently.
        person_body: whether the person is an adult drawn with sex, age, height and weight as in the
            United States (docs/persons.md). Not beside `person.body`, given measures of the person,
            or `person_scale`, which would be a second size.
        person_scale: relative width on all body lengths at once; masses scale with the cube.
        person_measures: relative width on each body measure independently.
        plant_stiffness: relative width on stretch and bending stiffness.
        plant_friction: relative width on friction.
        start_offset: width on each of the three start offsets, m.
    """

    arm_angle_deg: float = 0.0
    coat_scale: float = 0.0
    coat_measures: float = 0.0
    person_body: bool = False
    person_scale: float = 0.0
    person_measures: float = 0.0
    plant_stiffness: float = 0.0
    plant_friction: float = 0.0
    start_offset: float = 0.0


def _effect_schema(effect: type[Effect]) -> type:
    """Returns a dataclass with an effect's parameters and their standard deviations."""
    entries: list[tuple[str, Any, Any]] = []
    for p in effect.parameters():
        entries.append((p.name, float, field(default=p.off)))
        # As `drake-dress explain` found it; the simulation does not use it.
        entries.append((f"{p.name}_std", float, field(default=0.0)))
    return dataclasses.make_dataclass(effect.__name__, entries)


def effects_schema() -> type:
    """Returns a dataclass with all effects registered so far, including those of users."""
    entries = [(n, _effect_schema(e) | None, field(default=None)) for n, e in EFFECTS.items()]
    return dataclasses.make_dataclass("Effects", entries)


def costs_schema() -> type:
    """Returns a dataclass with all costs that users have registered so far."""
    entries: list[tuple[str, Any, Any]] = []
    for name, kind in COSTS.items():
        below = [(f.name, float, field(default=f.default)) for f in dataclasses.fields(kind)]
        entries.append((name, dataclasses.make_dataclass(name, below) | None, field(default=None)))
    return dataclasses.make_dataclass("Costs", entries)


# Sections whose keys are the names that are registered when a scenario is read.
SCHEMAS: dict[str, Callable[[], type]] = {
    "effects": effects_schema,
    "controller.costs": costs_schema,
}


@dataclass
class Log:
    """The log of a run.

    Attributes:
        rate: samples per second of simulated time, Hz.
    """

    rate: float = 30.0


@dataclass
class Scenario:
    """One run.

    Attributes:
        seed: seed of all random draws.
        duration: longest simulated time, s.
        garment: pattern of the garment.
        person: the person who is dressed.
        plant: simulated garment and person.
        controller: controllers.
        safety: limits of the safety governor.
        station: robots.
        perception: how controllers see the garment.
        lab: the lab of `drake-dress sim-station`.
        variation: quantities that the seed varies.
        log: the log of the run.
        effects: physical effects beyond the plain simulation, each with its parameters. An effect
            that is not given is off.
    """

    seed: int = 0
    duration: float = 90.0
    garment: Garment = field(default_factory=Garment)
    person: Person = field(default_factory=Person)
    plant: Plant = field(default_factory=Plant)
    controller: Controller = field(default_factory=Controller)
    safety: Safety = field(default_factory=Safety)
    station: Station = field(default_factory=Station)
    perception: Perception = field(default_factory=Perception)
    lab: Lab = field(default_factory=Lab)
    variation: Variation = field(default_factory=Variation)
    log: Log = field(default_factory=Log)
    effects: ValuesByName = field(default_factory=dict)
