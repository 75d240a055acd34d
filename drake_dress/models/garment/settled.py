"""Lets a garment creep into the shape in which its triangles have the size that they rest at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.layered import Integrator, LayeredCloth
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.state import ClothState

# Stiff enough that the cloth keeps its size, and as heavy as a coat's fabric.
MATERIAL = Material(surface_density=0.3, stretch_stiffness=2000.0, bending_stiffness=3e-3)
NO_GRAVITY = np.zeros(3)
NONE_HELD = np.zeros(0, dtype=np.int32)
# The cloth has no momentum from step to step, so that it creeps into its shape: long steps first
# close the seams, and it is at rest when no node moves by more than this in a step, m.
TIME_STEP, _AT_REST = 0.05, 2e-4
_MOST_STEPS = 60


def settled(
    integrator: Integrator,
    position: FloatArray,
    body: Obstacles,
    progress: Callable[[float], None],
) -> FloatArray:
    """Returns positions (n,3), m, at which the triangles keep their size as well as they can.

    Layers do not pass through each other. Nothing is random: a garment has one shape.

    Args:
        integrator: of the cloth, with `MATERIAL`, `TIME_STEP`, `NONE_HELD` and `NO_GRAVITY`, so
            that nothing slides off.
        position: (n,3) where the cloth begins, m.
        body: what it lies around, at rest.
        progress: called with the share of the work that is done.
    """
    cloth = LayeredCloth(integrator)
    still = np.zeros((0, 3))
    state = ClothState.at_rest(position)
    for k in range(_MOST_STEPS):
        after, _ = cloth.step(state, body, still)
        moved = float(np.linalg.norm(after.x - state.x, axis=1).max())
        state = replace(after, v=np.zeros_like(after.v))
        progress((k + 1) / _MOST_STEPS)
        if moved < _AT_REST:
            break
    return state.x
