"""Dry friction: modes of the nodes in contact, from the force that sticking would take.

Eq. contact-type with paper-notes' corrections: a node that would have to be pulled takes off, one
whose tangential force exceeds the cone slips with μ times its normal force, and the rest stick.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.modes import FREE, SLIP, STICK

# A node within this gap lies on the surface, m.
LYING = 1e-4
# Tolerated sum of friction beyond the cone, relative to what the cone allows.
TOLERATED_EXCESS = 0.01
# Maximum solves of the motion while modes are corrected by the resulting forces; fewer if solves
# are so coarse that a second correction gains little.
_MOST_REVISIONS = 4
_COARSE, _COARSE_REVISIONS = 1e-3, 2


@dataclass(frozen=True)
class Friction:
    """Contact types of c nodes.

    Attributes:
        mode: (c,) FREE, STICK or SLIP, of the motion.
        velocity_mode: (c,) the same for the velocity at the end: nodes that friction stops within
            the step stick.
        pressure: (c,) normal part of the sticking force, N.
        tangential: (c,) size of its tangential part, N.
        direction: (c,3) unit along that part.
        push: (c,3) friction on slipping nodes per normal force, μ d.
    """

    mode: IntArray
    velocity_mode: IntArray
    pressure: FloatArray
    tangential: FloatArray
    direction: FloatArray
    push: FloatArray


_NONE, _NONE_3 = np.zeros(0), np.zeros((0, 3))
_NO_MODE = np.zeros(0, dtype=np.int32)
NO_CONTACT = Friction(_NO_MODE, _NO_MODE, _NONE, _NONE, _NONE_3, _NONE_3)


def most_revisions(tolerance: float) -> int:
    """Returns the maximum number of solves of the motion, given their relative tolerance."""
    return _COARSE_REVISIONS if tolerance > _COARSE else _MOST_REVISIONS


def find_modes(
    reaction: FloatArray,
    normal: FloatArray,
    friction: float,
    momentum: FloatArray,
    time_step: float,
    known: tuple[IntArray, IntArray] | None = None,
) -> Friction:
    """Returns the contact types from the sticking force `reaction` (c,3), N.

    The sticking force t stops the motion; t − s / h, s the momentum of sliding, stops the velocity.
    Friction that exceeds the latter has stopped the node before the end of the step.

    Args:
        reaction: (c,3) sticking force, N.
        normal: (c,3) outward unit.
        friction: μ.
        momentum: (c,3) of the nodes relative to the surface, kg m/s.
        time_step: h, s.
        known: (c,) modes of motion and of velocity to use instead of finding them.
    """
    c = len(reaction)
    mode, velocity_mode = known or (np.empty(c, dtype=np.int32), np.empty(c, dtype=np.int32))
    pressure, tangential = np.empty(c), np.empty(c)
    direction, push = np.zeros((c, 3)), np.zeros((c, 3))
    _find_modes(
        reaction,
        normal,
        friction,
        momentum,
        time_step,
        known is None,
        mode,
        velocity_mode,
        pressure,
        tangential,
        direction,
        push,
    )
    return Friction(mode, velocity_mode, pressure, tangential, direction, push)


def revise_modes(
    binding: FloatArray,
    normal: FloatArray,
    gap: FloatArray,
    mu: float,
    friction: Friction,
    slide: bool,
) -> bool:
    """Corrects the modes, in place, by the forces that result; returns whether any changed.

    Nodes that would be pulled to a surface are released: across a gap they would gain energy, at
    h = 0.2 s twenty times what a falling sheet had. (A node that lies on the surface and is held
    back for a step gains none, and its release would only move the pull to its neighbours.)
    Sticking nodes beyond the friction cone slip if their total excess matters, because the
    forces of sticking press nodes that the motion does not press.

    Args:
        binding: (c,3) forces that bind the nodes, in any unit.
        normal: (c,3) outward unit.
        gap: (c,) gap at the start of the step, m.
        mu: friction coefficient.
        friction: modes, with the directions of all nodes.
        slide: whether sticking nodes may be made to slip.
    """
    return bool(
        _revise(
            binding,
            normal,
            gap,
            mu,
            friction.direction,
            friction.mode,
            friction.velocity_mode,
            friction.push,
            slide,
        )
    )


@nb.njit(cache=True, nogil=True)
def _revise(  # type: ignore[no-untyped-def]
    binding, normal, gap, mu, direction, mode, velocity_mode, push, slide
):
    changed = False
    excess = 0.0
    bound = 0.0
    over = np.zeros(mode.shape[0], dtype=np.bool_)
    for i in range(mode.shape[0]):
        if mode[i] == FREE:
            continue
        p = 0.0
        along = 0.0
        for c in range(3):
            p += binding[i, c] * normal[i, c]
            along += binding[i, c] * direction[i, c]
        if p < 0.0 and gap[i] > LYING:
            mode[i] = FREE
            velocity_mode[i] = FREE
            changed = True
            continue
        p = max(p, 0.0)
        bound += mu * p
        if mode[i] == STICK and along > mu * p:
            over[i] = True
            excess += along - mu * p
    if slide and excess > TOLERATED_EXCESS * bound:
        for i in range(mode.shape[0]):
            if over[i]:
                mode[i] = SLIP
                velocity_mode[i] = SLIP
                for c in range(3):
                    push[i, c] = mu * direction[i, c]
                changed = True
    return changed


@nb.njit(cache=True, nogil=True)
def _find_modes(  # type: ignore[no-untyped-def]
    reaction,
    normal,
    mu,
    momentum,
    h,
    judge,
    mode,
    velocity_mode,
    pressure,
    tangential,
    direction,
    push,
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
        if size > 0.0:
            for c in range(3):
                direction[i, c] = t[c] / size
                if mode[i] == SLIP:
                    push[i, c] = mu * direction[i, c]
        if judge:
            velocity_mode[i] = mode[i]
            if mode[i] == SLIP:
                sliding = 0.0
                for c in range(3):
                    sliding -= momentum[i, c] * direction[i, c]
                if mu * p > size - sliding / h:
                    velocity_mode[i] = STICK
