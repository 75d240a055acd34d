"""P of every garment, P_b = density M₁ + h² (stretch S₁ + bending C₁), from one sparse pattern.

S₁ is the stretch matrix and C₁ the bound of bending for unit stiffness: a garment's P costs three
numbers, so each garment of a batch may have its own fabric.
"""

# mypy: ignore-errors
# Kernels are in Warp's language: their annotations are Warp's types, which it checks itself.

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import warp as wp

from drake_dress.models.cloth.batch.parameters import Parameters
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import bending_bound, lumped_mass, stretch_matrix

wp.set_module_options({"enable_backward": False})


@wp.struct
class System:
    """P on a device.

    Attributes:
        start: (n+1,), column, entry: CSR of S₁ and C₁ with one pattern; an entry holds both.
        node_area: (n,) m².
        square: h², s².
    """

    start: wp.array[wp.int32]
    column: wp.array[wp.int32]
    entry: wp.array[wp.vec2d]
    node_area: wp.array[wp.float64]
    square: wp.float64


def make_system(elements: Elements, time_step: float, device: wp.Device) -> System:
    """Returns P of a mesh for a time step h, s."""
    unit = Material(stretch_stiffness=1.0, bending_stiffness=1.0)
    stretch = sp.csr_matrix(stretch_matrix(elements, unit))
    bending = sp.csr_matrix(bending_bound(elements, unit))
    pattern = sp.csr_matrix(abs(stretch) + abs(bending) + sp.identity(elements.node_count))
    pattern.sort_indices()
    system = System()
    system.start = wp.array(pattern.indptr.astype(np.int32), dtype=wp.int32, device=device)
    system.column = wp.array(pattern.indices.astype(np.int32), dtype=wp.int32, device=device)
    entry = np.column_stack([_on_pattern(m, pattern) for m in (stretch, bending)])
    system.entry = wp.array(entry, dtype=wp.vec2d, device=device)
    system.node_area = wp.array(elements.node_area, dtype=wp.float64, device=device)
    system.square = time_step**2
    return system


def system_matrix(elements: Elements, material: Material, time_step: float) -> sp.csc_matrix:
    """Returns P of one fabric, (n,n)."""
    stiffness = stretch_matrix(elements, material) + bending_bound(elements, material)
    mass = sp.diags(lumped_mass(elements, material))
    return sp.csc_matrix(mass + time_step**2 * stiffness)


@wp.func
def row_product(
    system: System,
    parameters: Parameters,
    z: wp.array2d[wp.vec3d],
    b: wp.int32,
    i: wp.int32,
) -> wp.vec3d:
    """Returns row i of P_b z_b."""
    stretch = system.square * parameters.stretch[b]
    bending = system.square * parameters.bending[b]
    total = (parameters.density[b] * system.node_area[i]) * z[b, i]
    for q in range(system.start[i], system.start[i + 1]):
        entry = system.entry[q]
        weight = stretch * entry[0] + bending * entry[1]
        total += weight * z[b, system.column[q]]
    return total


def _on_pattern(matrix: sp.csr_matrix, pattern: sp.csr_matrix):
    """Returns the values of `matrix` at the entries of `pattern`."""
    n = pattern.shape[0]
    keys = np.repeat(np.arange(n), np.diff(pattern.indptr)) * n + pattern.indices
    matrix.sort_indices()
    own = np.repeat(np.arange(n), np.diff(matrix.indptr)) * n + matrix.indices
    values = np.zeros(len(keys))
    values[np.searchsorted(keys, own)] = matrix.data
    return values
