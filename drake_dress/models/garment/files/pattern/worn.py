"""Gives a sewn pattern the shape that its flat panels take around a body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.layered import LayeredCloth
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.projective.projective_dynamics import (
    ProjectiveDynamicsCloth,
    ProjectiveSettings,
)
from drake_dress.models.cloth.state import ClothState
from drake_dress.models.garment.files.pattern.sewing import SewnPattern

# Stiff enough that the panels keep their size, and as heavy as a coat's fabric.
_MATERIAL = Material(surface_density=0.3, stretch_stiffness=2000.0, bending_stiffness=3e-3)
_NO_GRAVITY = np.zeros(3)
# The cloth has no momentum from step to step, so that it creeps into its shape: long steps first
# close the seams, and it is at rest when no node moves by more than this in a step, m.
_TIME_STEP, _AT_REST = 0.05, 2e-4
_MOST_STEPS = 60
_SETTINGS = ProjectiveSettings(tolerance=5e-5, max_iterations=100)
# The torso of the proxy: two upright capsules. Their radius and their distance from the middle are
# this share of the garment's girth, so that it goes around them with room. They begin this share of
# its height below its highest point.
_RADIUS, _BELOW_TOP = 1.0 / 14.0, 0.25


def worn(pattern: SewnPattern, progress: Callable[[float], None]) -> FloatArray:
    """Returns positions (n,3), m, at which the panels keep their flat shape as well as they can.

    y points up, and the panels stand around a body, as GarmentCode places them.
    Without gravity nothing slides off. Nothing is random: a pattern has one shape.

    Args:
        pattern: sewn panels.
        progress: called with the share of the work that is done.
    """
    elements = make_elements(pattern.position, pattern.faces, pattern.corners)
    held = np.zeros(0, dtype=np.int32)
    cloth = LayeredCloth(
        ProjectiveDynamicsCloth(
            elements, _MATERIAL, _TIME_STEP, held, _NO_GRAVITY, settings=_SETTINGS
        )
    )
    body = _body(pattern.position, float(elements.triangle_area.sum()))
    still = np.zeros((0, 3))
    state = ClothState.at_rest(pattern.position)
    for k in range(_MOST_STEPS):
        after, _ = cloth.step(state, body, still)
        moved = float(np.linalg.norm(after.x - state.x, axis=1).max())
        state = replace(after, v=np.zeros_like(after.v))
        progress((k + 1) / _MOST_STEPS)
        if moved < _AT_REST:
            break
    return state.x


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
