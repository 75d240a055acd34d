"""Friction of slipping nodes by fixed-point iteration, for schemes whose solver is symmetric.

In the forward problem, the friction of the last multipliers is a known force. In the backward
problem, the motion along the friction shifts the target along the normal. Each pass is a solve
without friction, and the passes contract by about μ.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.modes import SLIP

_MOST_PASSES = 60
# Tolerance of the solves above which one pass with friction is as good as more.
_COARSE = 1e-3
# Passes end when forces change by less than this many tolerances of the solves: each solve is warm
# started from the last and reduces the rest. They also end when a change is more than this share
# of the one before (_NO_CLOSER).
_COARSER = 10.0
_NO_CLOSER = 0.7

# Maps target (c,3) and force (c,3) to binding (c,3) and motion (c,3).
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
        plain: function that binds without friction.
        mode: (c,) of the nodes.
        normal: (c,3) unit.
        target: (c,3).
        push: (c,3) friction per normal force, or None.
        backward: solve the transposed problem.
        tolerance: relative tolerance of the change of forces between passes.
    """
    nothing = np.zeros_like(target)
    binding, z = plain(target, nothing)
    slip = (mode == SLIP)[:, None]
    friction, shifted = nothing, target
    if push is not None and push.any():
        change = np.inf
        for _ in range(1 if tolerance > _COARSE else _MOST_PASSES):
            before, last = binding, change
            if backward:
                lack = np.einsum("ij,ij->i", push, target - z)
                shifted = target + np.where(slip, lack[:, None] * normal, 0.0)
            else:
                multiplier = np.einsum("ij,ij->i", binding, normal)
                friction = np.where(slip, multiplier[:, None] * push, 0.0)
            binding, z = plain(shifted, friction)
            change = float(np.linalg.norm(binding - before))
            close = change <= _COARSER * tolerance * np.linalg.norm(binding)
            if close or change > _NO_CLOSER * last:
                break
    multiplier = np.einsum("ij,ij->i", binding, normal)
    return binding + friction, z, multiplier
