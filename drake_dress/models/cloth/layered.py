"""Self-collision of a plant's garment: keeps its layers from passing through each other.

Wraps any integrator with the interface of `ImplicitCloth`. In the linearly implicit scheme, pairs
of layers that would come too close resist within the step (`layers/bonds.py`). `LayerSeparation`
then corrects the result of any scheme so that no layers cross. Where gripper motion makes crossing
unavoidable, layers cross and are led back over the next steps (`layers/tangles.py`).
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
# Share of a pair's missing thickness that is recovered per step.
_RECOVERY = 0.2
# Resistance of a pair to approach, in median node masses. A third of it makes corrections five
# times as large; three times it costs the solver a third more iterations.
_RESISTANCE = 1000.0
# Speed at which crossed layers are led back, m/s. A fold of 2 cm is out in 0.2 s, because its
# neighbours help. At three times this speed, pinched cloth flew apart at 3 m/s.
_WAY_OUT = 0.03
# Search distance from crossed nodes to the layer that they have passed, in mean edge lengths.
_BEHIND = 0.5


class Integrator(Protocol):
    """Interface of the schemes that step a plant's garment."""

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
        """Returns the state one time step later, and information on the solve."""


class LayeredCloth:
    """Adds self-collision to an integrator.

    Other layers do not move nodes that are held or stick to the person, and move nodes that lie on
    the person only along its surface. Where layers would cross because of that, as in an armpit,
    friction and skin yield, by up to 1.5 mm in the folds that were examined. The force of layers on
    nodes in the grippers is not part of the grippers' force.

    Args:
        integrator: scheme that steps the garment.
        thickness: distance kept between layers, m.
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
        """Returns the tangle of the state, None if nothing pierces."""
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
        """Returns `after` with crossed layers moved back toward their own side."""
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
        """Returns the pairs that may come closer than the layer thickness."""
        h, thickness = self.time_step, self._layers.thickness
        pairs = self._layers.pairs(state.x, h * state.v, thickness).without(passing)
        rate = np.einsum("pm,pmk,pk->p", pairs.weights, state.v[pairs.node], pairs.direction)
        lacking = thickness - pairs.distance
        # Pairs that are too close part slowly; the others may approach up to the thickness.
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
    """Returns (n,) whether another layer has pushed a node, given its change of motion (n,3)."""
    pushed: BoolArray = np.any(rate_change != 0.0, axis=1)
    return pushed
