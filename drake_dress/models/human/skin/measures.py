"""Measures of a skin: heights, lengths and girths."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.human.skin.arm_girths import ArmGirths, arm_girths
from drake_dress.models.human.skin.phenotype import DENSITY
from drake_dress.models.human.skin.posing import sitting_drop
from drake_dress.models.human.skin.skin import Skin
from drake_dress.models.human.skin.trunk_girths import TrunkGirths, trunk_girths
from drake_dress.models.sides import SIDES

# Sizes that no skin gives: a neck has one radius here, and one length for all.
_NOT_MEASURED = ("neck_base_radius", "neck_length", "left", "right")
# Names of the sizes that `body_values` returns.
MEASURED = tuple(f.name for f in fields(BodyMeasures) if f.name not in _NOT_MEASURED)


@dataclass(frozen=True)
class SkinMeasures:
    """Measures of a person; lengths of arms and legs are means of both sides, m.

    Attributes:
        stature: height of the body.
        shoulder_height: height of the shoulder joints.
        shoulder_width: distance between the shoulder joints.
        upper_arm_length: from shoulder to elbow joint.
        lower_arm_length: from elbow to wrist joint.
        hand_length: from the wrist joint to the middle of the hand, the middle knuckle.
        seat_drop: how much lower the shoulders are when the person sits.
        arm: girths of the arms.
        trunk: girths of trunk, head and legs.
    """

    stature: float
    shoulder_height: float
    shoulder_width: float
    upper_arm_length: float
    lower_arm_length: float
    hand_length: float
    seat_drop: float
    arm: ArmGirths
    trunk: TrunkGirths


def skin_measures(skin: Skin) -> SkinMeasures:
    """Returns the measures of a skin.

    Raises:
        ValueError: a plane that measures a girth misses the skin.
    """
    places = {
        name: np.stack([skin.joints[f"{side}_{name}"] for side in SIDES])
        for name in ("shoulder", "elbow", "wrist", "knuckle_middle")
    }

    def length(start: str, end: str) -> float:
        return float(np.linalg.norm(places[end] - places[start], axis=1).mean())

    shoulders = places["shoulder"]
    arms = [arm_girths(skin, side) for side in SIDES]
    return SkinMeasures(
        stature=skin.stature,
        shoulder_height=float(shoulders[:, 2].mean()),
        shoulder_width=float(np.linalg.norm(shoulders[0] - shoulders[1])),
        upper_arm_length=length("shoulder", "elbow"),
        lower_arm_length=length("elbow", "wrist"),
        hand_length=length("wrist", "knuckle_middle"),
        seat_drop=sitting_drop(skin),
        arm=ArmGirths(
            *(float(np.mean([getattr(a, f.name) for a in arms])) for f in fields(ArmGirths))
        ),
        trunk=trunk_girths(skin),
    )


def body_values(m: SkinMeasures) -> dict[str, float]:
    """Returns the values of `BodyMeasures`, m and kg: the only place where both are known."""
    _, chest_width, chest_depth = m.trunk.ribs
    return {
        "shoulder_height": m.shoulder_height,
        "shoulder_width": m.shoulder_width,
        "upper_arm_length": m.upper_arm_length,
        "forearm_length": m.lower_arm_length + m.hand_length,
        "upper_arm_radius": m.arm.upper_arm,
        "elbow_radius": m.arm.elbow,
        "forearm_radius": m.arm.forearm,
        "wrist_radius": m.arm.wrist,
        "hand_radius": m.arm.hand,
        "chest_width": chest_width,
        "chest_depth": chest_depth,
        "torso_length": m.shoulder_height - m.trunk.crotch_height,
        "waist_width": m.trunk.waist[1],
        "waist_depth": m.trunk.waist[2],
        "hip_width": m.trunk.hips[1],
        "hip_depth": m.trunk.hips[2],
        "neck_radius": m.trunk.neck,
        "head_radius": m.trunk.head,
        "leg_length": 2.0 * m.seat_drop,
        "thigh_radius": m.trunk.thigh,
        "knee_radius": m.trunk.knee,
        "ankle_radius": m.trunk.ankle,
        "upper_arm_mass": DENSITY * m.arm.upper_arm_volume,
        "forearm_mass": DENSITY * m.arm.forearm_volume,
    }


def body_measures(measures: SkinMeasures) -> BodyMeasures:
    """Returns the sizes of the person of capsules that has these measures.

    Raises:
        UserError: they make no such person; see `BodyMeasures`.
    """
    return BodyMeasures(**body_values(measures))  # type: ignore[arg-type]
