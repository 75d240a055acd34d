"""The meshes of the benchmark: coats of a given spacing, a sheet and a tube."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment import COATS, GarmentMesh, make_coat

# Spacings at which the jacket nearly has the paper's 6,121 and 1,800 nodes: 6,168 and 1,793.
PAPER_SPACING = 0.0142
CONTROLLER_SPACING = 0.0264
# Spacing for quick runs of the same scenes: 392 nodes.
QUICK_SPACING = 0.06
# Spacings that give 963 to 25,210 nodes of the overcoat.
GROWTH_SPACINGS = (0.045, 0.032, 0.025, 0.018, 0.0125, 0.01)


@lru_cache(maxsize=8)
def jacket(spacing: float) -> GarmentMesh:
    """Returns the jacket at a mean edge length, m."""
    return make_coat(COATS["jacket"], spacing)


@lru_cache(maxsize=2)
def overcoat(spacing: float) -> GarmentMesh:
    """Returns the overcoat at a mean edge length, m."""
    return make_coat(COATS["overcoat"], spacing)


def grasp(mesh: GarmentMesh) -> IntArray:
    """Returns the held nodes (20,): ten of the left gripper, then ten of the right one."""
    return mesh.held


def sheet(columns: int, spacing: float) -> tuple[FloatArray, IntArray]:
    """Returns a square sheet in the xy plane: (columns²,3) positions, m, and (F,3) faces.

    Node i · columns + j lies at (i, j) · spacing.
    """
    i, j = np.meshgrid(np.arange(columns), np.arange(columns), indexing="ij")
    position = spacing * np.column_stack([i.ravel(), j.ravel(), 0 * i.ravel()]).astype(np.float64)
    row, column = i[:-1, :-1].ravel(), j[:-1, :-1].ravel()
    a, b = row * columns + column, (row + 1) * columns + column
    c, d = b + 1, a + 1
    odd = ((row + column) % 2 == 1)[:, None]
    first = np.where(odd, np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    second = np.where(odd, np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    return position, np.concatenate([first, second]).astype(np.int32)


def tube(around: int, along: int, radius: float, length: float) -> tuple[FloatArray, IntArray]:
    """Returns an open tube about the x axis from x = 0: (n,3) positions, m, and (F,3) faces.

    Node i · around + j is the j-th of ring i; ring 0 lies at x = 0. Faces look outward.
    """
    angle = 2.0 * np.pi * np.arange(around) / around
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    x = np.linspace(0.0, length, along)
    position = np.column_stack([np.repeat(x, around), np.tile(ring, (along, 1))])
    i, j = np.meshgrid(np.arange(along - 1), np.arange(around), indexing="ij")
    a, b = i * around + j, i * around + (j + 1) % around
    c, d = a + around, b + around
    # diagonals alternate, so that the fabric has no preferred shear direction
    even = ((i + j) % 2 == 0).ravel()
    first = np.stack([a, b, np.where((i + j) % 2 == 0, d, c)], axis=-1).reshape(-1, 3)
    second = np.where(
        even[:, None],
        np.stack([a, d, c], axis=-1).reshape(-1, 3),
        np.stack([b, d, c], axis=-1).reshape(-1, 3),
    )
    return position, np.concatenate([first, second]).astype(np.int32)
