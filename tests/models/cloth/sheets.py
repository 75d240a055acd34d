"""Small garments for tests."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements, make_elements


def sheet(columns: int, rows: int, spacing: float) -> tuple[FloatArray, IntArray]:
    """Returns a flat sheet in the xy plane: (n,3) positions, m, and (F,3) faces."""
    grid = np.stack(
        np.meshgrid(np.arange(columns) * spacing, np.arange(rows) * spacing, indexing="ij"), -1
    ).reshape(-1, 2)
    position = np.column_stack([grid, np.zeros(len(grid))])
    faces = []
    for i in range(columns - 1):
        for j in range(rows - 1):
            a, b = i * rows + j, (i + 1) * rows + j
            c, d = b + 1, a + 1
            faces += [[a, b, c], [a, c, d]] if (i + j) % 2 else [[a, b, d], [b, c, d]]
    return position, np.array(faces, dtype=np.int32)


def sheet_elements(columns: int, rows: int, spacing: float) -> tuple[FloatArray, Elements]:
    """Returns positions and elements of a flat sheet."""
    position, faces = sheet(columns, rows, spacing)
    return position, make_elements(position, faces)


NO_NODES = np.zeros(0, dtype=np.int32)
