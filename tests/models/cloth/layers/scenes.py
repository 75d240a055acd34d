"""Garments in layers, and pairs found the slow way."""

from __future__ import annotations

from itertools import product

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.layers.piercing import within_rings
from tests.models.cloth.sheets import sheet


def two_sheets(
    columns: int, spacing: float, height: float
) -> tuple[FloatArray, Elements, IntArray, IntArray]:
    """Returns positions, elements, the rim of the lower sheet and the nodes of the upper one."""
    lower, faces = sheet(columns, columns, spacing)
    upper = 0.9 * lower + [0.6 * spacing, 0.85 * spacing, height]
    k = np.arange(columns * columns)
    border = (k // columns % (columns - 1) == 0) | (k % columns % (columns - 1) == 0)
    x = np.vstack([lower, upper])
    e = make_elements(x, np.vstack([faces, faces + len(lower)]))
    return x, e, k[border].astype(np.int32), (k + len(lower)).astype(np.int32)


def crumpled(seed: int) -> tuple[FloatArray, Elements]:
    """Returns three uneven sheets one above the other, as one garment."""
    rng = np.random.default_rng(seed)
    layers, faces = [], []
    for k in range(3):
        x, f = sheet(7, 7, 0.02)
        x = x + rng.normal(scale=2e-3, size=x.shape) + [0.005 * k, 0.003 * k, 0.008 * k]
        faces.append(f + 49 * k)
        layers.append(x)
    x = np.vstack(layers)
    return x, make_elements(x, np.vstack(faces))


def all_pairs(e: Elements, rings: int) -> list[tuple[int, tuple[int, ...]]]:
    """Returns every node and triangle, edge and edge beyond each other's rings."""
    reach = [set(r.tolist()) for r in within_rings(e, rings)]
    found = []
    for p in range(e.node_count):
        for t in e.triangle.tolist():
            if not reach[p] & set(t):
                found.append((0, (p, *t)))
    edges = e.edge.tolist()
    for k, first in enumerate(edges):
        for second in edges[k + 1 :]:
            if all(b not in reach[a] for a, b in product(first, second)):
                found.append((1, (*first, *second)))
    return found
