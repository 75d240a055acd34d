"""A plant's garment whose layers do not pass through each other.

Wraps any integrator with the interface of `ImplicitCloth`. Pairs of layers that would come too
close resist within the step of the linearly implicit scheme (`layers/bonds.py`); what it, or
another, then proposes is corrected by `LayerSeparation`, so that nothing crosses. Where motions of
grippers leave no way, layers do cross, and are led back from then on (`layers/tangles.py`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.modes import HELD, STICK
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.influences import NO_INFLUENCES, Influences
from drake_dress.models.cloth.layers.bonds import Bonds
from drake_dress.models.cloth.layers.neighbours import Passing
from drake_dress.models.cloth.layers.separation import LayerSeparation
from drake_dress.models.cloth.layers.tangles import Tangle, Tangles
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.state import ClothState

# Nodes within this gap of the person are not pushed toward it, m.
_ON_THE_PERSON = 1e-3
# Share of what a pair lacks of the thickness that it makes up for in a step.
_RECOVERY = 0.2
# Resistance of a pair to approach, by the median mass of a node: with a third of it corrections are
# five times as large, with three times it the solver takes a third more iterations.
_RESISTANCE = 1000.0
# Speed at which layers that have crossed are led back, m/s: a fold of 2 cm is out in 0.2 s, for its
# neighbours help. With three times that what was pinched flew apart at 3 m/s.
_WAY_OUT = 0.03
# How far astray nodes look for the layer that they are behind, by the mean edge length.
_BEHIND = 0.5


class Integrator(Protocol):
    """What steps a plant's garment."""

    elements: Elements
    material: Material
    time_step: float
    held: IntArray
    mass: FloatArray
    gravity: FloatArray

    def step(
        self,
        state: ClothState,
        obstacles: Obstacles,
        held_velocity: FloatArray,
        influences: Influences = NO_INFLUENCES,
        guess: FloatArray | None = None,
    ) -> tuple[ClothState, Any]:
        """Returns the state one time step later, and how it was solved."""


class LayeredCloth:
    """Adds self-collision to an integrator.

    Other layers do not move nodes that are held or that stick to the person. They move nodes that
    lie on the person only along its surface. Where layers would cross because of that, as in an
    armpit, friction and skin yield, by up to 1.5 mm in the folds that were examined. The force of
    layers on nodes in the grippers is not part of the grippers' force.

    Args:
        integrator: steps the garment.
        thickness: distance that layers keep, m.
    """

    def __init__(self, integrator: Integrator, thickness: float = 2e-3) -> None:
        self.elements = integrator.elements
        self.material = integrator.material
        self.time_step = integrator.time_step
        self.held = integrator.held
        self.mass = integrator.mass
        self.gravity = integrator.gravity
        self._integrator = integrator
        self._layers = LayerSeparation(integrator.elements, thickness)
        self._tangles = Tangles(integrator.elements)
        self._resistance = _RESISTANCE * float(np.median(self.mass))
        self._behind = _BEHIND * float(integrator.elements.edge_rest_length.mean())

    def step(
        self,
        state: ClothState,
        obstacles: Obstacles,
        held_velocity: FloatArray,
        influences: Influences = NO_INFLUENCES,
        guess: FloatArray | None = None,
    ) -> tuple[ClothState, Any]:
        """Returns the state one time step later; see `ImplicitCloth.step`."""
        tangle = self._tangle(state)
        passing = None if tangle is None else tangle.passing
        given = replace(influences, bonds=self._bonds(state, passing))
        after, info = self._integrator.step(state, obstacles, held_velocity, given, guess)
        near = find_proximity(state.x, obstacles, self.material.margin)
        barred = np.where((near.gap < _ON_THE_PERSON)[:, None], near.normal, 0.0)
        w = inverse_mass(self.mass, after.mode)
        if tangle is not None:
            after = self._led_back(state, after, w, barred, tangle)
        return self._apart(state, after, w, barred, passing), info

    def _tangle(self, state: ClothState) -> Tangle | None:
        """Returns what pierces, if anything does."""
        if not state.tangled.any():
            return None
        return self._tangles.at(state.x, state.tangled.astype(np.bool_))

    def _led_back(
        self,
        before: ClothState,
        after: ClothState,
        w: FloatArray,
        barred: FloatArray,
        tangle: Tangle,
    ) -> ClothState:
        """Returns `after` with layers on their way back that have crossed."""
        h, dx = self.time_step, after.x - before.x
        pairs = self._layers.pairs(before.x, h * before.v, self._behind)
        moved = self._tangles.lead_back(tangle, before.x, dx, w, barred, pairs, _WAY_OUT * h)
        change = moved - dx
        return replace(after, x=before.x + moved, v=after.v + change / h)

    def _apart(
        self,
        before: ClothState,
        after: ClothState,
        w: FloatArray,
        barred: FloatArray,
        passing: Passing | None,
    ) -> ClothState:
        """Returns `after` with layers kept apart."""
        dx = after.x - before.x
        yielding = np.where(after.mode == HELD, 0.0, 1.0 / self.mass)
        moved, record = self._layers.correct(before.x, dx, w, barred, passing, yielding)
        x, v = after.x, after.v
        pushed = pushed_nodes(record.rate_change)
        if pushed.any():
            x, v = before.x + moved, after.v.copy()
            v[pushed] = (dx + record.rate_change)[pushed] / self.time_step
        tangled = before.tangled.astype(np.bool_)
        tangled[record.unparted] = True
        if tangled.any():
            tangled = self._tangles.near(x, tangled)
        return replace(after, x=x, v=v, tangled=tangled.astype(np.int32))

    def _bonds(self, state: ClothState, passing: Passing | None) -> Bonds:
        """Returns the pairs that may come closer than layers keep."""
        h, thickness = self.time_step, self._layers.thickness
        pairs = self._layers.pairs(state.x, h * state.v, thickness).without(passing)
        rate = np.einsum("pm,pmk,pk->p", pairs.weights, state.v[pairs.node], pairs.direction)
        lacking = thickness - pairs.distance
        # what is closer parts slowly, what is farther may come as near as layers keep
        share = np.where(lacking > 0.0, _RECOVERY, 1.0)
        return Bonds(
            pairs.node,
            pairs.weights[:, :, None] * pairs.direction[:, None, :],
            np.full(len(rate), self._resistance),
            share * lacking / h,
            lacking > h * np.minimum(rate, 0.0),
        )


def inverse_mass(mass: FloatArray, mode: IntArray) -> FloatArray:
    """Returns (n,) 1/kg, 0 for nodes that are held or stick."""
    return np.where((mode == STICK) | (mode == HELD), 0.0, 1.0 / mass)


def pushed_nodes(rate_change: FloatArray) -> BoolArray:
    """Returns (n,) which nodes another layer has pushed, by their change (n,3)."""
    pushed: BoolArray = np.any(rate_change != 0.0, axis=1)
    return pushed
