"""Gives a sewn pattern the shape that its flat panels take around a body."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.projective.projective_dynamics import (
    ProjectiveDynamicsCloth,
    ProjectiveSettings,
)
from drake_dress.models.garment.files.pattern.sewing import SewnPattern
from drake_dress.models.garment.settled import (
    MATERIAL,
    NO_GRAVITY,
    NONE_HELD,
    TIME_STEP,
    settled,
)

_SETTINGS = ProjectiveSettings(tolerance=5e-5, max_iterations=100)
# The torso of the proxy: two upright capsules. Their radius and their distance from the middle are
# this share of the garment's girth, so that it goes around them with room. They begin this share of
# its height below its highest point.
_RADIUS, _BELOW_TOP = 1.0 / 14.0, 0.25


def worn(pattern: SewnPattern, progress: Callable[[float], None]) -> FloatArray:
    """Returns positions (n,3), m, at which the panels keep their flat shape as well as they can.

    y points up, and the panels stand around a body, as GarmentCode places them.

    Args:
        pattern: sewn panels.
        progress: called with the share of the work that is done.
    """
    elements = make_elements(pattern.position, pattern.faces, pattern.corners)
    body = _body(pattern.position, float(elements.triangle_area.sum()))
    cloth = ProjectiveDynamicsCloth(
        elements, MATERIAL, TIME_STEP, NONE_HELD, NO_GRAVITY, settings=_SETTINGS
    )
    return settled(cloth, pattern.position, body, progress)


def _body(position: FloatArray, area: float) -> Obstacles:
    """Returns the torso of an upright body in the middle of a garment.

    Args:
        position: (n,3), m.
        area: area of all cloth, m². Over the garment's height it is a girth, with sleeves.
    """
    low, high = position.min(axis=0), position.max(axis=0)
    height = high[1] - low[1]
    radius, middle = _RADIUS * area / height, 0.5 * (low + high)
    top = high[1] - _BELOW_TOP * height - radius
    ends = [
        np.array([[middle[0] + sign * radius, y, middle[2]] for sign in (-1.0, 1.0)])
        for y in (min(low[1], top - 0.01), top)
    ]
    return Obstacles.resting(ends[0], ends[1], np.full(2, radius))
