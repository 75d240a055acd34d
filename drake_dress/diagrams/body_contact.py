"""Contact of the arms with trunk, legs, each other and a wheelchair.

The model is Drake's compliant point contact between shapes as thick as the limbs. An arm that
overlaps the torso in the rest pose, such as one that hangs at the side, is taken to be compressed
there: its shape is thinner by the overlap, so that the rest pose stays in equilibrium.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydrake.geometry import AddContactMaterial, ProximityProperties
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
    capsule_arrays,
    shoulder_joint,
)
from drake_dress.models.human.shape import PERSON
from drake_dress.models.sides import Side
from drake_dress.report.shapes import limb_shape

# Stiffness of each surface, N/m; two in series have half of it. An arm that the garment pulls
# against the chest with 20 N sinks in by 4 mm, like flesh.
_STIFFNESS = 1e4
# Dissipation, s/m, and friction coefficient of skin and clothes.
_DISSIPATION, _FRICTION = 5.0, 0.4
# Capsules that the rest pose makes thinner than this radius have no contact, m.
_LEAST_RADIUS = 0.01
# Thickness of the folded sleeve between an arm and a chair, with what a chair is thicker for the
# mesh of a garment (`met_by_mesh`), m. A chair does not give way as flesh does: without this room
# the cloth between both is pressed into one of them.
_SLEEVE = 12e-3


def add_body_contact(
    plant: MultibodyPlant,
    bodies: dict[str, RigidBody],
    capsules: tuple[Capsule, ...],
    measures: BodyMeasures,
    posture: Posture,
    arms: dict[Side, ArmPose],
) -> None:
    """Registers the collision geometry of a person and the chair.

    The shoulder girdle has none, because the upper arms begin in it.

    Args:
        plant: not finalized, with a SceneGraph.
        bodies: torso, upper arms and forearms by name.
        capsules: of all bodies, in body frames.
        measures: body sizes.
        posture: standing or sitting.
        arms: rest pose of each arm.
    """
    half = 0.5 * measures.shoulder_width

    def is_girdle(c: Capsule) -> bool:
        return c.part == PERSON and abs(c.a_B[1]) == abs(c.b_B[1]) == half

    trunk = [_padded(c) for c in capsules if c.body == "torso" and not is_girdle(c)]
    for number, capsule in enumerate(trunk):
        _collide(plant, bodies["torso"], capsule, 0.0, f"contact_{number}")
    still = _placed(trunk, np.eye(3), np.zeros(3))
    for side, pose in arms.items():
        upper, fore = arm_rotations(side, pose)
        shoulder = shoulder_joint(measures, posture, side)
        elbow = shoulder + upper @ np.array([0.0, 0.0, -measures.of(side).upper_arm_length])
        rest = {f"{side}_upper_arm": (upper, shoulder), f"{side}_forearm": (fore, elbow)}
        limbs = [c for c in capsules if c.body in rest]
        for number, capsule in enumerate(limbs):
            pairs = np.array([[0, k] for k in range(len(trunk))])
            gap = clearance(_placed([capsule], *rest[capsule.body]), still, pairs).distance.min()
            overlap = max(0.0, -float(gap))
            if min(capsule.radii) - overlap > _LEAST_RADIUS:
                name = f"{side}_contact_{number}"
                _collide(plant, bodies[capsule.body], capsule, overlap, name)


def _padded(capsule: Capsule) -> Capsule:
    """Returns a trunk's capsule, and a chair's with the sleeve that lies between it and an arm."""
    if capsule.part == PERSON:
        return capsule
    first, second = capsule.radii
    return replace(capsule, radius=first + _SLEEVE, end_radius=second + _SLEEVE)


def _placed(capsules: list[Capsule], rotation: FloatArray, origin: FloatArray) -> Capsules:
    """Returns a body's capsules in the torso's frame."""
    a, b, radius = capsule_arrays(capsules)
    return Capsules(a @ rotation.T + origin, b @ rotation.T + origin, radius)


def _collide(
    plant: MultibodyPlant, body: RigidBody, capsule: Capsule, thinner: float, name: str
) -> None:
    """Registers a capsule's collision geometry, with radii less by `thinner`, m."""
    skin = ProximityProperties()
    AddContactMaterial(
        dissipation=_DISSIPATION,
        point_stiffness=_STIFFNESS,
        friction=CoulombFriction(_FRICTION, _FRICTION),
        properties=skin,
    )
    first, second = (r - thinner for r in capsule.radii)
    shape, X_BG = limb_shape(capsule.a_B, capsule.b_B, (first, second), collides=True)
    plant.RegisterCollisionGeometry(body, X_BG, shape, name, skin)
