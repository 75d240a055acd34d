"""Applies effects: to a garment, as an integrator, and to the person and the sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import known_contacts
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.fibres import Fibres
from drake_dress.models.cloth.influences import NO_INFLUENCES, Influences
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.scheme import MakeIntegrator
from drake_dress.models.cloth.state import GRAVITY, Additions, ClothState
from drake_dress.models.effects.effect import (
    AdhesionEffect,
    BodyEffect,
    CameraEffect,
    ClockEffect,
    Effect,
    FibreEffect,
    ForceEffect,
    FrictionEffect,
    GravityEffect,
    MassEffect,
    MaterialEffect,
    ShapeEffect,
    Sheet,
    Sliding,
    StretchEffect,
    norms,
)
from drake_dress.models.human.body import BodyMeasures

Kind = TypeVar("Kind", bound=Effect)


def of_kind(effects: Sequence[Effect], kind: type[Kind]) -> list[Kind]:
    """Returns the effects of a kind that are not off."""
    return [e for e in effects if isinstance(e, kind) and not e.is_off]


class GarmentWithEffects:
    """An integrator of a garment on which effects act.

    Effects on grippers, cameras and the person's sizes are ignored here. Friction, adhesion and
    strain are evaluated at the start of the step.

    Args:
        rest_position: (n,3) without effects, m.
        faces: (F,3).
        grain: (F,3) direction of the warp in the frame of `rest_position`.
        material: material without effects.
        effects: effects of any kind.
        make: makes the inner integrator.
    """

    def __init__(
        self,
        rest_position: FloatArray,
        faces: npt.NDArray[np.integer],
        grain: FloatArray,
        material: Material,
        effects: Sequence[Effect],
        make: MakeIntegrator,
    ) -> None:
        for change in of_kind(effects, MaterialEffect):
            material = change.apply(material)
        elements = make_elements(rest_position, faces)
        shapes = of_kind(effects, ShapeEffect)
        if shapes:
            area = elements.triangle_area.sum()
            for shape in shapes:
                rest_position = shape.apply(rest_position)
            elements = make_elements(rest_position, faces)
            # the cloth keeps its mass
            density = material.surface_density * area / elements.triangle_area.sum()
            material = replace(material, surface_density=float(density))
        self.sheet = Sheet(elements, rest_position, grain)
        gravity = GRAVITY
        for tilt in of_kind(effects, GravityEffect):
            gravity = tilt.apply(gravity)
        added: FloatArray | None = None
        for mass in of_kind(effects, MassEffect):
            added = mass.apply(self.sheet) + (0.0 if added is None else added)
        fibres, along = None, of_kind(effects, FibreEffect)
        if along:
            stiffness = sum(fibre.apply(self.sheet) for fibre in along)
            fibres = Fibres.along(elements, rest_position, grain, 1.0)
            fibres = replace(fibres, weight=fibres.weight * stiffness)
        inner = make(elements, material, gravity, Additions(fibres, added))
        self.elements, self.material, self.time_step = elements, material, inner.time_step
        self.held, self.mass, self.gravity = inner.held, inner.mass, inner.gravity
        self._inner = inner
        self._forces = of_kind(effects, ForceEffect)
        self._frictions = of_kind(effects, FrictionEffect)
        self._stretches = of_kind(effects, StretchEffect)
        if self._frictions:
            self._warp_map = _warp_map(self.sheet)
        self._adhesion: FloatArray | None = None
        for cling in of_kind(effects, AdhesionEffect):
            pull = cling.apply(self.sheet)
            self._adhesion = pull if self._adhesion is None else self._adhesion + pull

    def step(
        self,
        state: ClothState,
        obstacles: Obstacles,
        held_velocity: FloatArray,
        influences: Influences = NO_INFLUENCES,
        guess: FloatArray | None = None,
    ) -> tuple[ClothState, Any]:
        """Returns the state one time step later; see `ImplicitCloth.step`."""
        influences = self._with_effects(influences, state, obstacles)
        return self._inner.step(state, obstacles, held_velocity, influences, guess)

    def _with_effects(
        self, given: Influences, state: ClothState, obstacles: Obstacles
    ) -> Influences:
        changed: dict[str, Any] = {}
        if self._forces:
            force = np.zeros_like(state.x) if given.force is None else given.force.copy()
            for effect in self._forces:
                force += effect.apply(self.sheet, state.x, state.v)
            changed["force"] = force
        if self._stretches:
            strain = largest_strain(self.elements, state.x)
            factor = np.ones(len(strain))
            for stretch in self._stretches:
                factor *= stretch.apply(strain)
            changed["stretch_factor"] = factor
        if self._adhesion is not None:
            changed["adhesion"] = self._adhesion
        if self._frictions:
            friction = np.full(len(state.x), self.material.friction)
            sliding = _sliding(self._warp_map, self.material.margin, state, obstacles)
            for rub in self._frictions:
                friction[sliding.nodes] += rub.apply(self.material.friction, sliding)
            changed["friction"] = np.maximum(friction, 0.0)
        return replace(given, **changed) if changed else given


def body_with_effects(measures: BodyMeasures, effects: Sequence[Effect]) -> BodyMeasures:
    """Returns the person's sizes with effects."""
    for effect in of_kind(effects, BodyEffect):
        measures = effect.apply(measures)
    return measures


def seen_points(position: FloatArray, effects: Sequence[Effect]) -> FloatArray:
    """Returns the positions that cameras with these effects report for world points (…,3), m."""
    for effect in of_kind(effects, CameraEffect):
        position = effect.apply(position)
    return position


def world_points(position: FloatArray, effects: Sequence[Effect]) -> FloatArray:
    """Returns the world points of positions (…,3), m, that cameras with these effects report."""
    for effect in reversed(of_kind(effects, CameraEffect)):
        position = effect.inverse(position)
    return position


def seen_rates(rate: FloatArray, effects: Sequence[Effect]) -> FloatArray:
    """Returns the velocities that cameras with these effects report for true ones (…,3), m/s."""
    return seen_points(rate, effects) - seen_points(np.zeros(3), effects)


def world_rates(rate: FloatArray, effects: Sequence[Effect]) -> FloatArray:
    """Returns the true velocities (…,3), m/s, that cameras with these effects report as `rate`."""
    return world_points(rate, effects) - world_points(np.zeros(3), effects)


def true_times(time: FloatArray, effects: Sequence[Effect], name: str) -> FloatArray:
    """Returns times, s, after the clock effect called `name`."""
    for effect in of_kind(effects, ClockEffect):
        if name == effect.NAME:
            time = effect.apply(time)
    return time


def largest_strain(elements: Elements, x: FloatArray) -> FloatArray:
    """Returns the larger principal strain (F,) of the triangles at `x` (n,3), m."""
    f = np.einsum("eia,eic->eac", elements.triangle_gradient, x[elements.triangle])
    c = np.einsum("eac,ebc->eab", f, f)
    mean, half = 0.5 * (c[:, 0, 0] + c[:, 1, 1]), 0.5 * (c[:, 0, 0] - c[:, 1, 1])
    strain: FloatArray = np.sqrt(mean + np.hypot(half, c[:, 0, 1])) - 1.0
    return strain


def _sliding(
    warp_map: sp.csr_array, margin: float, state: ClothState, obstacles: Obstacles
) -> Sliding:
    nodes = np.flatnonzero(state.owner >= 0).astype(np.int32)
    contacts = known_contacts(state.x, nodes, state.owner[nodes], obstacles, margin)
    relative, force = state.v[nodes] - contacts.surface_velocity, state.reaction[nodes]
    warp = warp_map[nodes] @ state.x
    return Sliding(
        nodes,
        _tangential(relative, contacts.normal),
        _tangential(force, contacts.normal),
        warp / np.maximum(norms(warp), 1e-300)[:, None],
    )


def _tangential(vector: FloatArray, normal: FloatArray) -> FloatArray:
    return vector - np.einsum("ij,ij->i", vector, normal)[:, None] * normal


def _warp_map(sheet: Sheet) -> sp.csr_array:
    """Returns W (n,n) such that W x is along the warp at the nodes, weighted by triangle areas.

    A triangle's warp is F u. Its warp u in its own frame is constant, and F is linear in its
    corners.
    """
    e = sheet.elements
    frame = np.einsum("eia,eic->eac", e.triangle_gradient, sheet.rest_position[e.triangle])
    flat = np.einsum("eac,ec->ea", frame, sheet.grain)
    weight = np.einsum("eia,ea,e->ei", e.triangle_gradient, flat, e.triangle_area)
    row, column = np.repeat(e.triangle, 3, axis=1), np.tile(e.triangle, (1, 3))
    entries = (np.tile(weight, (1, 3)).ravel(), (row.ravel(), column.ravel()))
    return sp.csr_array(entries, shape=(e.node_count, e.node_count))
