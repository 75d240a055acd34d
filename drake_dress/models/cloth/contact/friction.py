"""Dry friction: what nodes in contact do, judged by the force that sticking would take.

Eq. contact-type with paper-notes' corrections: a node that would have to be pulled takes off, one
whose tangential force exceeds the cone slips with μ times its normal force, the rest sticks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.cloth.elements import FloatArray, IntArray
from drake_dress.models.cloth.filtered_cg import FREE, SLIP, STICK


@dataclass(frozen=True)
class Friction:
    """Contact types of c nodes.

    Attributes:
        mode: (c,) FREE, STICK or SLIP.
        pressure: (c,) normal part of the sticking force, N.
        tangential: (c,) size of its tangential part, N.
        direction: (c,3) unit along that part of slipping nodes, else zero.
        force: (c,3) friction on slipping nodes, N.
    """

    mode: IntArray
    pressure: FloatArray
    tangential: FloatArray
    direction: FloatArray
    force: FloatArray


_NONE, _NONE_3 = np.zeros(0), np.zeros((0, 3))
NO_CONTACT = Friction(np.zeros(0, dtype=np.int32), _NONE, _NONE, _NONE_3, _NONE_3)


def find_modes(
    reaction: FloatArray, normal: FloatArray, friction: float, known: IntArray | None = None
) -> Friction:
    """Returns the contact types by the sticking force `reaction` (c,3), N.

    Args:
        reaction: (c,3) N.
        normal: (c,3) outward unit.
        friction: μ.
        known: (c,) modes to take instead of judging them.
    """
    c = len(reaction)
    mode = np.empty(c, dtype=np.int32) if known is None else known
    pressure, tangential = np.empty(c), np.empty(c)
    direction, force = np.zeros((c, 3)), np.zeros((c, 3))
    _find_modes(
        reaction, normal, friction, known is None, mode, pressure, tangential, direction, force
    )
    return Friction(mode, pressure, tangential, direction, force)


@nb.njit(cache=True, nogil=True)
def _find_modes(  # type: ignore[no-untyped-def]
    reaction, normal, mu, judge, mode, pressure, tangential, direction, force
):
    t = np.empty(3)
    for i in range(reaction.shape[0]):
        p = 0.0
        for c in range(3):
            p += reaction[i, c] * normal[i, c]
        size = 0.0
        for c in range(3):
            t[c] = reaction[i, c] - p * normal[i, c]
            size += t[c] * t[c]
        size = np.sqrt(size)
        pressure[i] = p
        tangential[i] = size
        if judge:
            if p <= 0.0:
                mode[i] = FREE
            elif size > mu * p:
                mode[i] = SLIP
            else:
                mode[i] = STICK
        if mode[i] == SLIP and size > 0.0:
            for c in range(3):
                direction[i, c] = t[c] / size
                force[i, c] = mu * p * direction[i, c]
