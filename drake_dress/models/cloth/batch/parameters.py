"""The fabrics of a batch, one value per garment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from drake_dress.models.cloth.batch.arrays import scalars_in
from drake_dress.models.cloth.material import Material


@wp.struct
class Parameters:
    """Fabrics on a device, all (B,): see `Material` for units."""

    stretch: wp.array[wp.float64]
    bending: wp.array[wp.float64]
    density: wp.array[wp.float64]
    friction: wp.array[wp.float64]
    margin: wp.array[wp.float64]


def make_parameters(materials: Sequence[Material], device: wp.Device) -> Parameters:
    """Returns the parameters of one material per garment."""
    parameters = Parameters()
    for name, field in (
        ("stretch", "stretch_stiffness"),
        ("bending", "bending_stiffness"),
        ("density", "surface_density"),
        ("friction", "friction"),
        ("margin", "margin"),
    ):
        values = np.array([getattr(m, field) for m in materials])
        setattr(parameters, name, scalars_in(values, name, len(materials), device))
    return parameters


def replace_parameters(parameters: Parameters, **arrays: wp.array | None) -> Parameters:
    """Returns parameters with some (B,) arrays of the same device exchanged; None keeps one."""
    changed = Parameters()
    for name in ("stretch", "bending", "density", "friction", "margin"):
        new = arrays.get(name)
        setattr(changed, name, getattr(parameters, name) if new is None else new)
    return changed


def central_material(materials: Sequence[Material]) -> Material:
    """Returns the fabric whose P is the best preconditioner for all of them.

    P is linear in density and stiffnesses, so the eigenvalues of P⁻¹ P_b lie between the least and
    the largest ratio of their values; the geometric mean of the extremes makes that range smallest.
    """

    def middle(name: str) -> float:
        values = [getattr(m, name) for m in materials]
        low, high = min(values), max(values)
        return float(low if low == high else np.sqrt(max(low, 1e-6 * high) * high))

    return Material(
        surface_density=middle("surface_density"),
        stretch_stiffness=middle("stretch_stiffness"),
        bending_stiffness=middle("bending_stiffness"),
    )


def share_one_system(materials: Sequence[Material]) -> bool:
    """Returns whether P is the same for all of them."""
    systems = {(m.surface_density, m.stretch_stiffness, m.bending_stiffness) for m in materials}
    return len(systems) == 1
