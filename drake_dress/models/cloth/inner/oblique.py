"""Friction of slipping nodes by fixed-point iteration, for schemes whose solver is symmetric.

Forward the friction of the last multipliers is a known force, backward the motion along the
friction shifts the target along the normal: each pass is a solve without friction, and the passes
contract by about μ.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drake_dress.models.cloth.elements import FloatArray, IntArray
from drake_dress.models.cloth.filtered_cg import SLIP

_MOST_PASSES = 60

# target (c,3) and force (c,3) to binding (c,3) and motion (c,3)
PlainHold = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


def hold_obliquely(
    plain: PlainHold,
    mode: IntArray,
    normal: FloatArray,
    target: FloatArray,
    push: FloatArray | None,
    backward: bool,
    tolerance: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns force (c,3), motion (c,3) and multipliers (c,) of `StepSystem.hold`.

    Args:
        plain: binds without friction.
        mode: (c,) of the nodes.
        normal: (c,3) unit.
        target: (c,3).
        push: (c,3) friction per normal force, or None.
        backward: solve the transposed problem.
        tolerance: of the change of forces from pass to pass, relative.
    """
    nothing = np.zeros_like(target)
    binding, z = plain(target, nothing)
    slip = (mode == SLIP)[:, None]
    friction, shifted = nothing, target
    if push is not None and push.any():
        for _ in range(_MOST_PASSES):
            before = binding
            if backward:
                lack = np.einsum("ij,ij->i", push, target - z)
                shifted = target + np.where(slip, lack[:, None] * normal, 0.0)
            else:
                multiplier = np.einsum("ij,ij->i", binding, normal)
                friction = np.where(slip, multiplier[:, None] * push, 0.0)
            binding, z = plain(shifted, friction)
            if np.linalg.norm(binding - before) <= tolerance * np.linalg.norm(binding):
                break
    multiplier = np.einsum("ij,ij->i", binding, normal)
    return binding + friction, z, multiplier
