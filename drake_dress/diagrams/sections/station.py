"""The section `station`: placement of arms and cameras."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from drake_dress.diagrams.arms import ArmPlacement
from drake_dress.diagrams.cameras import Camera
from drake_dress.diagrams.scenario import schema
from drake_dress.diagrams.scenario.mirror import model_of
from drake_dress.diagrams.sections.person import measures, posture
from drake_dress.models.human.body import shoulder_height


def cameras(section: Sequence[schema.Camera]) -> tuple[Camera, ...]:
    """Returns the cameras; degrees become radians."""
    return tuple(
        Camera(
            c.name,
            np.array(c.position),
            np.array(c.target),
            c.width,
            c.height,
            math.radians(c.fov_deg),
            c.rate,
        )
        for c in section
    )


def placement(
    arms: schema.Arms, person: schema.Person, side: str = schema.Station.side
) -> ArmPlacement | None:
    """Returns the placement of both arms at a side of the person; None where grippers float."""
    if arms.model == "floating":
        return None
    shoulders = shoulder_height(measures(person), posture(person))
    return ArmPlacement(
        arms.distance_behind,
        arms.spread,
        shoulders + arms.height_offset,
        math.radians(arms.tilt_deg),
        model_of(arms.resolved_rate),
        in_front=side == "front",
    )
