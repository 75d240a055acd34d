"""The person as bodies of a MultibodyPlant: a torso that is fixed or turns, and compliant arms.

Each arm has three hinges at the shoulder and one at the elbow, each with a spring and a damper
about the scenario's pose. Muscle tone holds the pose against gravity: constant torques, which do
not change when the arm moves. So a hand's compliance follows from the springs together with the
change of gravity's torques away from the pose. A person who turns also has a joint about the
vertical, which the stance holds at the wanted yaw.

Limitations: the torso does not sway, and it turns as one body with the legs. Above the horizontal,
gravity pulls an arm away from its pose. A pose there is unstable unless the shoulder's stiffness
exceeds the negative stiffness of the arm's weight (up to 7.6 N·m/rad for the measures preset).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    FixedOffsetFrame,
    ModelInstanceIndex,
    PdControllerGains,
    RevoluteJoint,
    RevoluteSpring,
    RigidBody,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import Context

from drake_dress.diagrams.body_contact import add_body_contact
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.control.person_model import PersonModel
from drake_dress.models.human.arm import JOINT_NAMES, Arm, Arms
from drake_dress.models.human.body import (
    ArmPose,
    BodyMeasures,
    Capsule,
    Posture,
    capsule_arrays,
    shoulder_joint,
)
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.human.shape import CHAIR
from drake_dress.models.human.wheelchair import Wheelchair, seated_capsules
from drake_dress.models.round_cone import solid
from drake_dress.models.sides import SIDES, Side
from drake_dress.report.shapes import CHAIR_COLOR, limb_shape

_SKIN = np.array([0.87, 0.68, 0.55, 1.0])
_CHAIR = np.array([*CHAIR_COLOR, 1.0])
# Stance, N·m/rad and N·m·s/rad: a coat that pulls at one side of the chest with 20 N turns the
# person by less than a degree; critically damped with the torso's inertia.
_STANCE_STIFFNESS, _STANCE_DAMPING = 300.0, 40.0


@dataclass(frozen=True)
class Person:
    """A person that `add_person` added to a plant.

    Attributes:
        model: the person's model instance.
        capsules: of all bodies, in body frames; those of a wheelchair are fixed in the torso.
        body_indices: of the bodies that have capsules, by name.
        joint_points: body index and point in the body's frame (3,), m, of shoulder, elbow, hand,
            left then right; `joint_positions` evaluates them.
        radius: (6,) limb radius at those points, m.
        origin: of the torso's frame (3,), m, world.
        turns: whether the torso has a joint about the vertical.
    """

    model: ModelInstanceIndex
    capsules: tuple[Capsule, ...]
    body_indices: dict[str, BodyIndex]
    joint_points: list[tuple[int, FloatArray]]
    radius: FloatArray
    origin: FloatArray
    turns: bool = False

    @property
    def placed_capsules(self) -> list[tuple[int, Capsule]]:
        """All capsules, each with the index of its body."""
        return [(int(self.body_indices[c.body]), c) for c in self.capsules]

    def tone_torque(self, plant: MultibodyPlant) -> FloatArray:
        """Returns the generalized forces (nv,) that balance gravity in the rest pose, N·m.

        This muscle tone holds the arms up and does not change when they move. Connect it to the
        plant's applied generalized force port; it is zero for all other models in the plant.

        Args:
            plant: finalized, with the person's rest pose in its default context.
        """
        gravity = plant.CalcGravityGeneralizedForces(plant.CreateDefaultContext())
        torque = np.zeros(plant.num_velocities())
        plant.SetVelocitiesInArray(
            self.model, -plant.GetVelocitiesFromArray(self.model, gravity), torque
        )
        return torque

    def arm_dofs(self, plant: MultibodyPlant) -> IndexArray:
        """Returns the indices (8,) of the arms' joints in the plant's velocities: left, then right.

        The order in each arm is abduction, extension, rotation, elbow.
        """
        names = [f"{side}_{name}" for side in SIDES for name in JOINT_NAMES]
        starts = [plant.GetJointByName(n, self.model).velocity_start() for n in names]
        return np.array(starts, dtype=np.intp)

    def own_dofs(self, plant: MultibodyPlant) -> IndexArray:
        """Returns the indices of the person's velocities in the plant's, in the instance's order.

        All joints are hinges, so positions and velocities have the same order.
        """
        every = np.arange(plant.num_velocities(), dtype=np.float64)
        return plant.GetVelocitiesFromArray(self.model, every).astype(np.intp)


def add_person(
    plant: MultibodyPlant,
    measures: BodyMeasures,
    posture: Posture,
    arms: dict[Side, ArmPose],
    joints: JointParameters,
    position: FloatArray | None = None,
    turns: bool = False,
    chair: Wheelchair | None = None,
) -> Person:
    """Adds a person who stands or sits at `position` (2,), m, and faces +x.

    The default context of the finalized plant has the person in the rest pose. If the plant has a
    SceneGraph, the bodies are drawn, and the arms have contact with trunk, legs and each other.

    Args:
        plant: not finalized.
        measures: body sizes and masses.
        posture: standing or sitting.
        arms: rest pose of each arm. An angle beyond a limit is kept, and the limit moved to it.
        joints: stiffness, damping and limits, by side.
        position: of the torso on the floor; the origin when None.
        turns: whether the torso turns about the vertical; else it is welded to the world.
        chair: wheelchair of a sitting person, which arms and garment touch; it turns with them.

    Raises:
        UserError: an arm is missing, the position is not two finite numbers, or the posture is
            unknown.
    """
    _check_both(arms)
    origin = _origin(position)
    model = plant.AddModelInstance("person")
    capsules = seated_capsules(measures, posture, chair)
    torso = _add_torso(plant, model, origin, turns)
    bodies: dict[str, RigidBody] = {"torso": torso}
    points: list[tuple[int, FloatArray]] = []
    for side in SIDES:
        own = measures.of(side)
        upper, fore = _add_arm(plant, model, torso, own, posture, side, arms[side], joints.of(side))
        bodies[f"{side}_upper_arm"], bodies[f"{side}_forearm"] = upper, fore
        hand = np.array([0.0, 0.0, -own.forearm_length])
        points += [
            (int(upper.index()), np.zeros(3)),
            (int(fore.index()), np.zeros(3)),
            (int(fore.index()), hand),
        ]
    if plant.geometry_source_is_registered():
        for i, c in enumerate(capsules):
            _register(plant, bodies[c.body], c, f"{c.body}_{i}")
        add_body_contact(plant, bodies, capsules, measures, posture, arms)
    radius = [r for side in SIDES for r in measures.of(side).joint_radii]
    return Person(
        model,
        capsules,
        {name: body.index() for name, body in bodies.items()},
        points,
        np.array(radius),
        origin,
        turns,
    )


def _check_both(arms: dict[Side, ArmPose]) -> None:
    """Checks that no arm is missing."""
    missing = [side for side in SIDES if side not in arms]
    if missing:
        raise UserError("person", "arms", f"lacks {', '.join(missing)}, expected left and right")


def _origin(position: FloatArray | None) -> FloatArray:
    """Returns the origin (3,) of the torso's frame, m, world.

    Raises:
        UserError: the position is not two finite numbers.
    """
    place = np.zeros(2) if position is None else np.asarray(position, dtype=np.float64)
    if place.shape != (2,) or not np.all(np.isfinite(place)):
        raise UserError(
            "person", "position", f"has shape {place.shape}, expected (2,) finite numbers of m"
        )
    return np.array([place[0], place[1], 0.0])


def person_arms(
    measures: BodyMeasures, posture: Posture, arms: dict[Side, ArmPose], joints: JointParameters
) -> Arms:
    """Returns the model of both arms that `add_person` makes from the same values."""
    rest = np.array([angles_of(arms[side]) for side in SIDES])
    own = [joints.of(side) for side in SIDES]
    left, right = (Arm(measures, posture, side) for side in SIDES)
    return Arms(
        (left, right),
        rest,
        np.stack(
            [
                [np.minimum(j.limits[0], r), np.maximum(j.limits[1], r)]
                for j, r in zip(own, rest, strict=True)
            ]
        ),
        np.stack([j.stiffness for j in own]),
        np.stack([j.damping for j in own]),
        (own[0].tone > 0.0, own[1].tone > 0.0),
    )


def person_model(
    body: BodyMeasures, stance: Posture, person: Person, arms: Arms | None = None
) -> PersonModel:
    """Returns the controllers' model of a person: capsules, shoulders, limb radii and arms."""
    of_arms = [c for c in person.capsules if c.body != "torso"]
    return PersonModel(
        capsules=person.capsules,
        shoulders=np.stack([shoulder_joint(body, stance, side) for side in SIDES]),
        radius=capsule_arrays(of_arms)[2].reshape(2, 3, 2),
        arms=arms,
    )


def angles_of(pose: ArmPose) -> list[float]:
    """Returns abduction, extension, rotation and elbow of a pose, rad, as the joints' order."""
    return [pose.abduction, pose.extension, pose.rotation, pose.elbow_flexion]


def _add_torso(
    plant: MultibodyPlant, model: ModelInstanceIndex, origin: FloatArray, turns: bool
) -> RigidBody:
    """Adds the torso, welded to the world, or on a joint about the vertical if it turns."""
    torso = plant.AddRigidBody("torso", model, SpatialInertia.SolidBoxWithMass(60.0, 0.2, 0.4, 0.6))
    X_WTorso = RigidTransform(origin)
    if turns:
        _add_stance(plant, torso, X_WTorso)
    else:
        plant.WeldFrames(plant.world_frame(), torso.body_frame(), X_WTorso)
    return torso


def _add_stance(plant: MultibodyPlant, torso: RigidBody, X_WTorso: RigidTransform) -> None:
    """Adds the joint about which a person turns; its actuator holds a desired yaw."""
    foot = plant.AddFrame(FixedOffsetFrame("stance_frame", plant.world_frame(), X_WTorso))
    joint = plant.AddJoint(
        RevoluteJoint("stance", foot, torso.body_frame(), np.array([0.0, 0.0, 1.0]))
    )
    actuator = plant.AddJointActuator("stance", joint)
    actuator.set_controller_gains(PdControllerGains(p=_STANCE_STIFFNESS, d=_STANCE_DAMPING))


def _add_arm(
    plant: MultibodyPlant,
    model: ModelInstanceIndex,
    torso: RigidBody,
    m: BodyMeasures,
    posture: Posture,
    side: Side,
    pose: ArmPose,
    joints: JointParameters,
) -> tuple[RigidBody, RigidBody]:
    sign = 1.0 if side == "left" else -1.0
    # The shoulder is three hinges; the bodies between them exist only to connect these.
    link = SpatialInertia.SolidSphereWithMass(0.05, 0.03)
    first = plant.AddRigidBody(f"{side}_shoulder_1", model, link)
    second = plant.AddRigidBody(f"{side}_shoulder_2", model, link)
    of_upper, of_fore = m.arm_masses
    upper = plant.AddRigidBody(
        f"{side}_upper_arm", model, _limb(of_upper, m.upper_arm_radii, m.upper_arm_length)
    )
    fore = plant.AddRigidBody(
        f"{side}_forearm", model, _limb(of_fore, m.forearm_radii, m.forearm_length)
    )
    at_shoulder = RigidTransform(shoulder_joint(m, posture, side))
    at_elbow = RigidTransform(np.array([0.0, 0.0, -m.upper_arm_length]))
    k, d = joints.shoulder_stiffness, joints.shoulder_damping
    ke, de = joints.elbow_stiffness, joints.elbow_damping
    x, y, z = np.eye(3)
    chain = (
        ("abduction", torso, at_shoulder, first, sign * x, pose.abduction, k, d),
        ("extension", first, None, second, y, pose.extension, k, d),
        ("rotation", second, None, upper, sign * z, pose.rotation, k, d),
        ("elbow", upper, at_elbow, fore, -y, pose.elbow_flexion, ke, de),
    )
    for name, parent, X_PJ, child, axis, angle, stiffness, damping in chain:
        low, high = getattr(joints, f"{name}_limits")
        joint = plant.AddJoint(
            RevoluteJoint(
                name=f"{side}_{name}",
                frame_on_parent=plant.AddFrame(_fixed(f"{side}_{name}", parent, X_PJ)),
                frame_on_child=child.body_frame(),
                axis=axis,
                pos_lower_limit=min(low, angle),
                pos_upper_limit=max(high, angle),
                damping=damping,
            )
        )
        joint.set_default_angle(angle)
        plant.AddForceElement(RevoluteSpring(joint, angle, stiffness))
    return upper, fore


def _fixed(name: str, parent: RigidBody, X_PJ: RigidTransform | None) -> FixedOffsetFrame:
    return FixedOffsetFrame(f"{name}_frame", parent.body_frame(), X_PJ or RigidTransform())


def _limb(mass: float, radii: tuple[float, float], length: float) -> SpatialInertia:
    """Returns the inertia of a solid round cone from the origin down to −length."""
    axis = np.array([0.0, 0.0, 1.0])
    if radii[0] == radii[1]:
        unit = UnitInertia.SolidCapsule(radii[0], length, axis)
        center = np.array([0.0, 0.0, -0.5 * length])
    else:
        s = solid(length, radii)
        unit = UnitInertia.AxiallySymmetric(s.about_axis, s.across, axis)
        center = np.array([0.0, 0.0, -s.center])
    return SpatialInertia(mass, np.zeros(3), unit).Shift(-center)


def _register(plant: MultibodyPlant, body: RigidBody, capsule: Capsule, name: str) -> None:
    shape, X_BG = limb_shape(capsule.a_B, capsule.b_B, capsule.radii)
    color = _CHAIR if capsule.part == CHAIR else _SKIN
    plant.RegisterVisualGeometry(body, X_BG, shape, name, color)


def joint_positions(plant: MultibodyPlant, context: Context, person: Person) -> FloatArray:
    """Returns (6,3) shoulder, elbow, hand of left, then of right, m, world."""
    return np.stack(
        [
            plant.EvalBodyPoseInWorld(context, plant.get_body(BodyIndex(body))) @ p
            for body, p in person.joint_points
        ]
    )
