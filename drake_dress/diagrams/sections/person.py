"""The section `person`: body, posture and behaviour."""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_dress.diagrams.behaviour import Behaviour, Kind
from drake_dress.diagrams.person import angles_of
from drake_dress.diagrams.scenario import schema
from drake_dress.diagrams.scenario.mirror import model_of
from drake_dress.models.human import motions
from drake_dress.models.human.active import ActiveParameters
from drake_dress.models.human.arm import JOINT_NAMES, Arm
from drake_dress.models.human.body import ArmMeasures, ArmPose, BodyMeasures, Posture
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.human.lowering import Lowering
from drake_dress.models.human.muscles import sagged
from drake_dress.models.human.skin.phenotype import Phenotype
from drake_dress.models.human.spasm import SpasmParameters
from drake_dress.models.human.wheelchair import Wheelchair
from drake_dress.models.sides import SIDES, Side


def measures(person: schema.Person) -> BodyMeasures:
    """Returns the dimensions of the body."""
    sides: tuple[ArmMeasures, ...] = tuple(
        model_of(values) for values in (person.left_measures, person.right_measures)
    )
    left, right = (own if own.given else None for own in sides)
    body: BodyMeasures = model_of(person.measures, left=left, right=right)
    return body


def phenotype(person: schema.Person) -> Phenotype | None:
    """Returns sex, age, height and weight; None if the body is a scan, or measures alone."""
    body = person.body
    if body is None:
        return None
    sex, age, height, weight = body.sex, body.age, body.height, body.weight
    if sex is None or age is None or height is None or weight is None:
        return None
    return Phenotype(sex, age, height, weight, body.muscle)


def posture(person: schema.Person) -> Posture:
    """Returns the posture; the scenario's check has verified its name."""
    return "sitting" if person.posture == "sitting" else "standing"


def arms(person: schema.Person) -> dict[Side, ArmPose]:
    """Returns the pose in which both arms rest; arms with little muscle tone sag into it."""
    poses: dict[Side, ArmPose] = {"left": arm(person.left_arm), "right": arm(person.right_arm)}
    both = joints(person)
    for side, pose in poses.items():
        own = both.of(side)
        if own.tone < 1.0:
            limb = Arm(measures(person), posture(person), side)
            angles = np.array(angles_of(pose))
            poses[side] = ArmPose(
                *sagged(limb, angles, own.stiffness, own.tone, own.limits).tolist()
            )
    return poses


def arm(values: schema.Arm) -> ArmPose:
    """Returns an arm's pose; degrees become radians."""
    return ArmPose(
        *np.deg2rad(
            [values.abduction_deg, values.extension_deg, values.rotation_deg, values.elbow_deg]
        )
    )


def chair(person: schema.Person) -> Wheelchair | None:
    """Returns the wheelchair that the person sits in, if any."""
    found: Wheelchair | None = None if person.chair is None else model_of(person.chair)
    return found


def joints(person: schema.Person) -> JointParameters:
    """Returns the parameters of the arms' joints; degrees become radians."""
    both = _joint_values(person.joints)
    left, right = (
        JointParameters(**both | own) if own else None
        for own in map(_joint_values, (person.left_joints, person.right_joints))
    )
    return JointParameters(**both, left=left, right=right)


def _joint_values(group: schema.Joints | schema.SideJoints) -> dict[str, Any]:
    """Returns the given values by the names of the model's fields."""
    values = {name: value for name, value in vars(group).items() if value is not None}
    for name in JOINT_NAMES:
        limits = values.pop(f"{name}_limits_deg", None)
        if limits is not None:
            values[f"{name}_limits"] = tuple(np.deg2rad(limits).tolist())
    return values


def behaviour(b: schema.Behaviour, seed: int) -> Behaviour:
    """Returns the person's behaviour; `seed` is that of tremor and spasms."""
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
        spasm=spasm(b.spasm) if b.spasm is not None else None,
        seed=seed,
        lowering=lowering(b.lowering),
        stirring=model_of(b.stirring),
    )


def spasm(values: schema.Spasm) -> SpasmParameters:
    """Returns an arm's spasms."""
    given = dict(vars(values))
    side = given.pop("side")
    return SpasmParameters(sides=tuple(s for s in SIDES if side in (s, "both")), **given)


def lowering(values: schema.Lowering) -> Lowering:
    """Returns how the arms are lowered; degrees become radians."""
    angles = np.deg2rad([values.abduction_deg, values.extension_deg, 0.0, values.elbow_deg])
    return Lowering(ArmPose(*angles), values.duration)


def motion(values: schema.Motion) -> motions.Motion:
    """Returns the one motion whose key is set; degrees become radians."""
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
