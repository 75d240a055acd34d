"""Compares gripper forces with the garment's weight: unit, sign and direction of gravity."""

from __future__ import annotations

import numpy as np

from drake_dress.discrepancy.reading.plausibility import at_start, axis_name
from drake_dress.discrepancy.reading.raw import RawRecording
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES

_GRAVITY = 9.81
# Surface density of any fabric, kg/m²: voile to a lined winter coat.
_LIGHTEST, _HEAVIEST = 0.04, 2.5
# Factor by which a garment may be lighter or heavier than the scenario's.
_FACTOR = 3.5
# Least cosine between the force at rest and the vertical: a world frame that is not level, and
# wind, tilt the force by a few degrees.
_DOWN = 0.7
# Largest plausible force of arms that hold a garment, or of a person, N.
_MOST = 1000.0
# Name of both grippers' forces in messages.
_BOTH = "gripper/*/force"
# Force of one newton in other units.
_UNITS = (
    (1e3, "millinewtons"),
    (101.97, "grams-force"),
    (0.10197, "kilograms-force"),
    (0.2248, "pounds-force"),
    (3.597, "ounces-force"),
    (1e5, "dynes"),
)


def check_forces(
    raw: RawRecording,
    time: FloatArray,
    force: FloatArray,
    mesh: GarmentMesh,
    surface_density: float | None,
) -> None:
    """Raises UserError if forces are not those of the garment on the grippers, in N.

    While a garment hangs, both grippers together bear its weight.

    Args:
        raw: the recording.
        time: (T,) s.
        force: (T,2,3) N, NaN where not measured.
        mesh: the scenario's garment.
        surface_density: of its fabric, kg/m²; None allows any.
    """
    begin, whole = at_start(time, force), _mean(force)
    if not np.isfinite(begin).all():
        return
    least, most = (_GRAVITY * _area(mesh) * d for d in _densities(surface_density))
    totals = [begin.sum(axis=0), whole.sum(axis=0)]
    sizes = [float(np.linalg.norm(t)) for t in totals]
    _check_signs_agree(raw, begin, sizes[0], least)
    # a garment that starts on the person hangs from the grippers later, or the other way round
    bearing = [t for t, size in zip(totals, sizes, strict=True) if least <= size <= most]
    if not bearing:
        raise _not_the_weight(raw, sizes[0], least, most)
    _check_points_down(raw, bearing)
    _check_sizes(raw, force)


def _check_signs_agree(raw: RawRecording, begin: FloatArray, total: float, least: float) -> None:
    """Raises UserError if one gripper's force has the wrong sign.

    Args:
        raw: the recording.
        begin: (2,3) forces at the start, N.
        total: magnitude of their sum, N.
        least: smallest weight of the garment, N.
    """
    for k, other in ((0, 1), (1, 0)):
        # one force points up, one down, and their sum is less than the weight
        if begin[k, 2] > 0.25 * least and begin[other, 2] < -0.25 * least and total < least:
            raise UserError(
                raw.source,
                raw.key(f"gripper/{SIDES[k]}/force"),
                f"points up, {begin[k, 2]:.3g} N, where the other gripper's points down: the sign "
                "is reversed, expected the force of the garment on the gripper",
            )


def _not_the_weight(raw: RawRecording, total: float, least: float, most: float) -> UserError:
    """Returns the error for forces that are too small or too large for the garment's weight.

    Args:
        raw: the recording.
        total: magnitude of both grippers' total force at the start, N.
        least: smallest weight of the garment, N.
        most: largest weight of the garment, N.
    """
    unit = _unit(total, float(np.sqrt(least * most)), _FACTOR)
    hint = f"; is it in {unit}?" if unit else ""
    if not unit and total > most:
        hint = "; was the sensor tared without the garment?"
    return UserError(
        raw.source,
        raw.key(_BOTH),
        f"is {total:.3g} N in all while the garment hangs, expected newtons, its weight, "
        f"{least:.2g} to {most:.2g} N{hint}",
    )


def _check_points_down(raw: RawRecording, bearing: list[FloatArray]) -> None:
    """Raises UserError if none of the forces (3,) of the weight's magnitude points down."""
    down = [-float(t[2] / np.linalg.norm(t)) for t in bearing]
    if max(down) < -_DOWN:
        raise UserError(
            raw.source,
            raw.key(_BOTH),
            f"points up, {bearing[0][2]:.3g} N in all: the sign is reversed, expected the force of "
            "the garment on the gripper, down (-z)",
        )
    if max(down) < _DOWN:
        raise UserError(
            raw.source,
            raw.key(_BOTH),
            f"points along {axis_name(bearing[0])} while the garment hangs, expected down (-z) in "
            "the world's frame, z up",
        )


def _check_sizes(raw: RawRecording, force: FloatArray) -> None:
    """Raises UserError if a force component (T,2,3) exceeds every plausible force."""
    for k, side in enumerate(SIDES):
        largest = float(np.nanmax(np.abs(force[:, k])))
        if largest > _MOST:
            at = int(np.nanargmax(np.abs(force[:, k]).max(axis=1)))
            raise UserError(
                raw.source,
                raw.key(f"gripper/{side}/force"),
                f"is {largest:.4g} N at sample {at}, expected newtons, up to {_MOST:g}",
            )


def _densities(surface_density: float | None) -> tuple[float, float]:
    if surface_density is None:
        return _LIGHTEST, _HEAVIEST
    return surface_density / _FACTOR, surface_density * _FACTOR


def _unit(size: float, weight: float, factor: float) -> str:
    """Returns the unit in which a force of this size is nearest to the weight; empty if none is."""
    off = {name: abs(np.log(max(size, 1e-9) / per / weight)) for per, name in _UNITS}
    name = min(off, key=lambda n: off[n])
    return name if off[name] < np.log(factor) else ""


def _mean(force: FloatArray) -> FloatArray:
    """Returns (2,3) the mean of the measured forces, N."""
    there = np.isfinite(force)
    total: FloatArray = np.where(there, force, 0.0).sum(axis=0) / np.maximum(there.sum(axis=0), 1)
    return total


def _area(mesh: GarmentMesh) -> float:
    """Returns the area of all triangles, m²."""
    a, b, c = (mesh.rest_position[mesh.faces[:, k]] for k in range(3))
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
