"""A plant's garment whose layers do not pass through each other.

Wraps any integrator with the interface of `ImplicitCloth`. Pairs of layers that would come too
close resist within the step of the linearly implicit scheme (`layers/bonds.py`); what it, or
another, then proposes is corrected by `LayerSeparation`, so that nothing crosses.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import BoolArray, Elements, FloatArray, IntArray
from drake_dress.models.cloth.filtered_cg import HELD, STICK
from drake_dress.models.cloth.implicit import ClothState
from drake_dress.models.cloth.influences import NO_INFLUENCES, Influences
from drake_dress.models.cloth.layers.bonds import Bonds
from drake_dress.models.cloth.layers.neighbours import Pairs
from drake_dress.models.cloth.layers.separation import Expected, LayerSeparation
from drake_dress.models.cloth.material import Material

# Nodes within this gap of the person are not pushed toward it, m.
_ON_THE_PERSON = 1e-3
# Share of what a pair lacks of the thickness that it makes up for in a step.
_RECOVERY = 0.2
# Resistance of a pair to approach, by the median mass of a node: with a third of it corrections are
# five times as large, with three times it the solver takes a third more iterations.
_RESISTANCE = 1000.0


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
    """An integrator with self-collision.

    Nodes that are held or stick to the person are not moved by other layers, those that lie on the
    person only along its surface. What layers do to nodes in the grippers is not part of the
    grippers' force.

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
        self._resistance = _RESISTANCE * float(np.median(self.mass))

    def step(
        self,
        state: ClothState,
        obstacles: Obstacles,
        held_velocity: FloatArray,
        influences: Influences = NO_INFLUENCES,
        guess: FloatArray | None = None,
    ) -> tuple[ClothState, Any]:
        """Returns the state one time step later; see `ImplicitCloth.step`."""
        expected = self._layers.expect(state.x, self.time_step * state.v)
        bonds = self._bonds(state, expected.pairs)
        given = replace(influences, bonds=bonds)
        after, info = self._integrator.step(state, obstacles, held_velocity, given, guess)
        near = find_proximity(state.x, obstacles, self.material.margin)
        barred = np.where((near.gap < _ON_THE_PERSON)[:, None], near.normal, 0.0)
        x, v = separate(
            self._layers,
            self.mass,
            self.time_step,
            state.x,
            after.x,
            after.v,
            after.mode,
            barred,
            expected,
        )
        return replace(after, x=x, v=v), info

    def _bonds(self, state: ClothState, pairs: Pairs) -> Bonds:
        """Returns those of `pairs` that would come closer than layers keep by themselves."""
        h, thickness = self.time_step, self._layers.thickness
        rate = np.einsum("pm,pmk,pk->p", pairs.weights, state.v[pairs.node], pairs.direction)
        fall = np.einsum("pm,pk,k->p", pairs.weights, pairs.direction, self.gravity)
        near = pairs.distance + h * np.minimum(rate + h * fall, 0.0) < thickness
        lacking = thickness - pairs.distance[near]
        # what is closer parts slowly, what is farther may come as near as layers keep
        share = np.where(lacking > 0.0, _RECOVERY, 1.0)
        return Bonds(
            np.ascontiguousarray(pairs.node[near]),
            pairs.weights[near][:, :, None] * pairs.direction[near][:, None, :],
            np.full(np.count_nonzero(near), self._resistance),
            share * lacking / h,
        )


def separate(
    layers: LayerSeparation,
    mass: FloatArray,
    time_step: float,
    x: FloatArray,
    proposed: FloatArray,
    velocity: FloatArray,
    mode: IntArray,
    barred: FloatArray,
    expected: Expected | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Returns positions and velocities (n,3) after layers have been kept apart.

    Args:
        layers: of the garment.
        mass: (n,) kg.
        time_step: s.
        x: (n,3) positions before the step, m.
        proposed: (n,3) positions after it, m.
        velocity: (n,3) after it, m/s.
        mode: (n,) contact types in it.
        barred: (n,3) unit directions along which nodes may not be moved, or zero.
        expected: pairs that were found before the step.
    """
    dx = proposed - x
    moved, record = layers.correct(x, dx, inverse_mass(mass, mode), barred, expected)
    pushed = pushed_nodes(record.rate_change)
    if not pushed.any():
        return proposed, velocity
    after = velocity.copy()
    after[pushed] = (dx + record.rate_change)[pushed] / time_step
    return x + moved, after


def inverse_mass(mass: FloatArray, mode: IntArray) -> FloatArray:
    """Returns (n,) 1/kg, 0 for nodes that are held or stick."""
    return np.where((mode == STICK) | (mode == HELD), 0.0, 1.0 / mass)


def pushed_nodes(rate_change: FloatArray) -> BoolArray:
    """Returns (n,) which nodes another layer has pushed, by their change (n,3)."""
    pushed: BoolArray = np.any(rate_change != 0.0, axis=1)
    return pushed
