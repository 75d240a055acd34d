"""The person as bodies of a MultibodyPlant: a torso that stands, arms that yield."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Capsule as CapsuleShape
from pydrake.geometry import Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    ModelInstanceIndex,
    RevoluteJoint,
    RevoluteSpring,
    RigidBody,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import Context

from drake_dress.models.human.body import (
    SIDES,
    ArmPose,
    BodyMeasures,
    Capsule,
    Posture,
    Side,
    body_capsules,
    shoulder_joint,
)

FloatArray = np.ndarray
_SKIN = np.array([0.87, 0.68, 0.55, 1.0])


@dataclass(frozen=True)
class JointParameters:
    """How the arms' joints yield: N·m/rad and N·m·s/rad."""

    shoulder_stiffness: float = 2.0
    shoulder_damping: float = 1.0
    elbow_stiffness: float = 1.5
    elbow_damping: float = 0.4


# Anatomical limits, rad: abduction, extension (backward positive), rotation, elbow flexion.
_LIMITS = {
    "abduction": (-0.6, 2.6),
    "extension": (-2.6, 1.2),
    "rotation": (-1.2, 1.2),
    "elbow": (0.0, 2.5),
}


@dataclass(frozen=True)
class Person:
    """What `add_person` made.

    Attributes:
        model: the person's model instance.
        capsules: of all bodies, in body frames.
        body_indices: of the bodies that have capsules, by name.
        joint_points: body index and point in its frame of shoulder, elbow, hand, left then right.
        radius: (6,) limb radius at those points, m.
        posture_angles: (4,) per side, the rest pose, rad.
    """

    model: ModelInstanceIndex
    capsules: tuple[Capsule, ...]
    body_indices: dict[str, BodyIndex]
    joint_points: list[tuple[int, FloatArray]]
    radius: FloatArray

    def tone_torque(self, plant: MultibodyPlant) -> FloatArray:
        """Returns the generalized forces (nv,) that balance gravity in the rest pose, N·m.

        Muscle tone holds the arms up; it does not change when they are moved. `plant` is finalized.
        """
        context = plant.CreateDefaultContext()
        torque: FloatArray = -plant.CalcGravityGeneralizedForces(context)
        return torque


def add_person(
    plant: MultibodyPlant,
    measures: BodyMeasures,
    posture: Posture,
    arms: dict[Side, ArmPose],
    joints: JointParameters,
    position: FloatArray | None = None,
) -> Person:
    """Adds a person who stands or sits at `position` (2,), m, and faces +x.

    Args:
        plant: not finalized.
        measures: body sizes and masses.
        posture: standing or sitting.
        arms: rest pose of each arm.
        joints: stiffness and damping.
        position: of the torso on the floor; the origin when None.
    """
    model = plant.AddModelInstance("person")
    capsules = body_capsules(measures, posture)
    origin = np.zeros(3) if position is None else np.array([position[0], position[1], 0.0])
    torso = plant.AddRigidBody("torso", model, SpatialInertia.SolidBoxWithMass(60.0, 0.2, 0.4, 0.6))
    plant.WeldFrames(plant.world_frame(), torso.body_frame(), RigidTransform(origin))
    bodies: dict[str, RigidBody] = {"torso": torso}
    points: list[tuple[int, FloatArray]] = []
    for side in SIDES:
        upper, fore = _add_arm(plant, model, torso, measures, posture, side, arms[side], joints)
        bodies[f"{side}_upper_arm"], bodies[f"{side}_forearm"] = upper, fore
        hand = np.array([0.0, 0.0, -measures.forearm_length])
        points += [
            (int(upper.index()), np.zeros(3)),
            (int(fore.index()), np.zeros(3)),
            (int(fore.index()), hand),
        ]
    if plant.geometry_source_is_registered():
        for i, c in enumerate(capsules):
            _register(plant, bodies[c.body], c, f"{c.body}_{i}")
    limb = [measures.upper_arm_radius, measures.forearm_radius, measures.hand_radius]
    return Person(
        model,
        capsules,
        {name: body.index() for name, body in bodies.items()},
        points,
        np.array(limb * 2),
    )


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
    # The shoulder is three hinges; the bodies between them only need to have some inertia.
    link = SpatialInertia.SolidSphereWithMass(0.05, 0.03)
    first = plant.AddRigidBody(f"{side}_shoulder_1", model, link)
    second = plant.AddRigidBody(f"{side}_shoulder_2", model, link)
    upper = plant.AddRigidBody(
        f"{side}_upper_arm", model, _limb(m.upper_arm_mass, m.upper_arm_radius, m.upper_arm_length)
    )
    fore = plant.AddRigidBody(
        f"{side}_forearm", model, _limb(m.forearm_mass, m.forearm_radius, m.forearm_length)
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
    for name, parent, X_PJ, child, axis, angle, stiffness, damping in chain:  # noqa: N806
        low, high = _LIMITS[name]
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


def _fixed(name: str, parent: RigidBody, X_PJ: RigidTransform | None):  # type: ignore[no-untyped-def]  # noqa: N803
    from pydrake.multibody.tree import FixedOffsetFrame

    return FixedOffsetFrame(f"{name}_frame", parent.body_frame(), X_PJ or RigidTransform())


def _limb(mass: float, radius: float, length: float) -> SpatialInertia:
    """Returns the inertia of a solid capsule from the origin down to −length."""
    unit = UnitInertia.SolidCapsule(radius, length, np.array([0.0, 0.0, 1.0]))
    center = np.array([0.0, 0.0, -0.5 * length])
    return SpatialInertia(mass, np.zeros(3), unit).Shift(-center)


def _register(plant: MultibodyPlant, body: RigidBody, capsule: Capsule, name: str) -> None:
    axis = capsule.b_B - capsule.a_B
    length = float(np.linalg.norm(axis))
    center = 0.5 * (capsule.a_B + capsule.b_B)
    if length < 1e-9:
        plant.RegisterVisualGeometry(
            body, RigidTransform(center), Sphere(capsule.radius), name, _SKIN
        )
        return
    rotation = RotationMatrix.MakeFromOneVector(axis / length, 2)
    plant.RegisterVisualGeometry(
        body, RigidTransform(rotation, center), CapsuleShape(capsule.radius, length), name, _SKIN
    )


def joint_positions(plant: MultibodyPlant, context: Context, person: Person) -> FloatArray:
    """Returns (6,3) shoulder, elbow, hand of left, then of right, m, world."""
    return np.stack(
        [
            plant.EvalBodyPoseInWorld(context, plant.get_body(BodyIndex(body))) @ p
            for body, p in person.joint_points
        ]
    )
