"""Limbs that do not go through the body: contact of the arms with trunk, legs and each other.

Compliant point contact of Drake, between capsules that are as thick as the limbs. What touches in
the rest pose already, as an arm that hangs at the side, is taken to be pressed together there: the
arm's capsule is thinner by that much, so that the rest pose stays one.
"""

from __future__ import annotations

import numpy as np
from pydrake.geometry import AddContactMaterial, ProximityProperties, Sphere
from pydrake.geometry import Capsule as CapsuleShape
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import RigidBody

from drake_dress.models.arm.clearance import Capsules, clearance
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.body import (
    ArmPose,
    BodyMeasures,
    Capsule,
    Posture,
    arm_rotations,
    shoulder_joint,
)
from drake_dress.models.sides import Side

# Of each surface, N/m; two in series have half of it. An arm that the garment draws against the
# chest with 20 N goes 4 mm into it, as flesh does.
_STIFFNESS = 1e4
# s/m; and of skin and clothes.
_DISSIPATION, _FRICTION = 5.0, 0.4
# A capsule that the rest pose leaves less of than this has no contact, m.
_LEAST_RADIUS = 0.01


def add_body_contact(
    plant: MultibodyPlant,
    bodies: dict[str, RigidBody],
    capsules: tuple[Capsule, ...],
    measures: BodyMeasures,
    posture: Posture,
    arms: dict[Side, ArmPose],
) -> None:
    """Registers what of a person collides with the rest of it.

    The shoulder girdle does not: upper arms begin in it.

    Args:
        plant: not finalized, with a SceneGraph.
        bodies: torso, upper arms and forearms by name.
        capsules: of all bodies, in body frames.
        measures: body sizes.
        posture: standing or sitting.
        arms: rest pose of each arm.
    """
    half = 0.5 * measures.shoulder_width
    trunk = [
        c for c in capsules if c.body == "torso" and not abs(c.a_B[1]) == abs(c.b_B[1]) == half
    ]
    for number, capsule in enumerate(trunk):
        _collide(plant, bodies["torso"], capsule, capsule.radius, f"contact_{number}")
    still = _placed(trunk, np.eye(3), np.zeros(3))
    for side, pose in arms.items():
        upper, fore = arm_rotations(side, pose)
        shoulder = shoulder_joint(measures, posture, side)
        elbow = shoulder + upper @ np.array([0.0, 0.0, -measures.upper_arm_length])
        rest = {f"{side}_upper_arm": (upper, shoulder), f"{side}_forearm": (fore, elbow)}
        limbs = [c for c in capsules if c.body in rest]
        for number, capsule in enumerate(limbs):
            pairs = np.array([[0, k] for k in range(len(trunk))])
            gap = clearance(_placed([capsule], *rest[capsule.body]), still, pairs).distance.min()
            radius = capsule.radius + min(0.0, float(gap))
            if radius > _LEAST_RADIUS:
                name = f"{side}_contact_{number}"
                _collide(plant, bodies[capsule.body], capsule, radius, name)


def _placed(capsules: list[Capsule], rotation: FloatArray, origin: FloatArray) -> Capsules:
    """Returns capsules of a body in the torso's frame."""
    return Capsules(
        np.stack([c.a_B for c in capsules]) @ rotation.T + origin,
        np.stack([c.b_B for c in capsules]) @ rotation.T + origin,
        np.array([c.radius for c in capsules]),
    )


def _collide(
    plant: MultibodyPlant, body: RigidBody, capsule: Capsule, radius: float, name: str
) -> None:
    axis = capsule.b_B - capsule.a_B
    length = float(np.linalg.norm(axis))
    center = 0.5 * (capsule.a_B + capsule.b_B)
    skin = ProximityProperties()
    AddContactMaterial(
        dissipation=_DISSIPATION,
        point_stiffness=_STIFFNESS,
        friction=CoulombFriction(_FRICTION, _FRICTION),
        properties=skin,
    )
    if length < 1e-9:
        plant.RegisterCollisionGeometry(body, RigidTransform(center), Sphere(radius), name, skin)
        return
    turned = RigidTransform(RotationMatrix.MakeFromOneVector(axis / length, 2), center)
    plant.RegisterCollisionGeometry(body, turned, CapsuleShape(radius, length), name, skin)
