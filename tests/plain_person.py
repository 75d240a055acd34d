"""A controller's person of plain measures."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.person_model import PersonModel
from drake_dress.models.human.body import (
    ArmPose,
    BodyMeasures,
    Posture,
    arm_points,
    body_capsules,
    shoulder_joint,
)
from drake_dress.models.sides import SIDES

M = BodyMeasures()


def plain_person(posture: Posture) -> PersonModel:
    """Returns the person as the controller models it."""
    return PersonModel(
        body_capsules(M, posture),
        np.stack([shoulder_joint(M, posture, side) for side in SIDES]),
        (M.upper_arm_radius, M.forearm_radius, M.hand_radius),
    )


def plain_joints(
    posture: Posture, pose: ArmPose, frame: tuple[FloatArray, FloatArray] | None = None
) -> FloatArray:
    """Returns the joints (6,3), m, with both arms in `pose`; `frame` is that of the torso."""
    where = () if frame is None else (frame,)
    return np.vstack([arm_points(M, posture, side, pose, *where) for side in SIDES])
