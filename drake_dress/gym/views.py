"""Cameras that an environment adds to a scenario: for images if it has none, and for videos."""

from __future__ import annotations

import numpy as np

from drake_dress.diagrams.scenario import Scenario
from drake_dress.diagrams.scenario.schema import Camera
from drake_dress.diagrams.sections.person import measures, posture
from drake_dress.models.human.body import shoulder_height

# From behind and to the left, where both openings and both hands are visible; for a garment that is
# put on from the front, from the front and to the left.
_DIRECTION = np.array([-0.82, 0.48, 0.32])
_DISTANCE = 2.6  # m
_FIELD_OF_VIEW = 45.0  # vertical, degrees
_BELOW_SHOULDERS, _BEHIND = 0.3, 0.15  # of the image's centre, from the shoulders, m


def view_of(scenario: Scenario, name: str, width: int, height: int) -> Camera:
    """Returns a camera that sees person and garment.

    Args:
        scenario: scenario with the person.
        name: name of the camera.
        width: width of its image, pixels.
        height: height of its image, pixels.
    """
    shoulders = shoulder_height(measures(scenario.person), posture(scenario.person))
    side = np.array([-1.0 if scenario.station.side == "front" else 1.0, 1.0, 1.0])
    target = np.array([-_BEHIND, 0.0, shoulders - _BELOW_SHOULDERS]) * side
    return Camera(
        name=name,
        position=(target + _DISTANCE * side * _DIRECTION).tolist(),
        target=target.tolist(),
        width=width,
        height=height,
        fov_deg=_FIELD_OF_VIEW,
    )
