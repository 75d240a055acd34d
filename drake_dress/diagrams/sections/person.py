"""The section `person`: body, posture and behaviour."""

from __future__ import annotations

import numpy as np

from drake_dress.diagrams.behaviour import Behaviour, Kind
from drake_dress.diagrams.person import JointParameters
from drake_dress.diagrams.scenario import schema
from drake_dress.diagrams.scenario.mirror import model_of
from drake_dress.models.human import motions
from drake_dress.models.human.active import ActiveParameters
from drake_dress.models.human.arm import JOINT_NAMES
from drake_dress.models.human.body import ArmMeasures, ArmPose, BodyMeasures, Posture
from drake_dress.models.human.lowering import Lowering
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


def posture(person: schema.Person) -> Posture:
    """Returns the posture; the scenario's check has verified its name."""
    return "sitting" if person.posture == "sitting" else "standing"


def arms(person: schema.Person) -> dict[Side, ArmPose]:
    """Returns the pose of both arms."""
    return {"left": arm(person.left_arm), "right": arm(person.right_arm)}


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
    """Returns stiffness, damping and limits of the arms' joints; degrees become radians."""
    values = dict(vars(person.joints))
    for name in JOINT_NAMES:
        limits = values.pop(f"{name}_limits_deg")
        if limits is not None:
            values[f"{name}_limits"] = tuple(np.deg2rad(limits).tolist())
    return JointParameters(**values)


def behaviour(b: schema.Behaviour, seed: int) -> Behaviour:
    """Returns the person's behaviour; `seed` is that of its tremor."""
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
        seed=seed,
        lowering=lowering(b.lowering),
        stirring=model_of(b.stirring),
    )


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
