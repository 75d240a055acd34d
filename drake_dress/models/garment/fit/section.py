"""The length of cloth that a horizontal plane cuts, and the gap at an open front."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.garment.edges import border_edges


def cloth_around(position: FloatArray, faces: IntArray, height: float) -> float:
    """Returns the length of the cut through the faces at a height, m; 0 if none is cut.

    Args:
        position: (n,3), m.
        faces: (F,3), only those that count.
        height: of the plane, m.
    """
    above = position[:, 2] >= height
    count = above[faces].sum(axis=1)
    cut = faces[(count > 0) & (count < 3)]
    if len(cut) == 0:
        return 0.0
    # the node that is alone on its side of the plane; both its edges are cut
    single = above[cut] == (above[cut].sum(axis=1) == 1)[:, None]
    k, rows = np.argmax(single, axis=1), np.arange(len(cut))
    lone, ahead, behind = (cut[rows, (k + j) % 3] for j in range(3))
    ends = [_crossing(position, lone, other, height) for other in (ahead, behind)]
    return float(np.linalg.norm(ends[0] - ends[1], axis=1).sum())


def front_gap(
    position: FloatArray, faces: IntArray, counted: BoolArray, height: float
) -> float | None:
    """Returns the distance between the two border edges at a height, m.

    None if the plane does not cut just two, as where the garment is closed or has slits.

    Args:
        position: (n,3), m.
        faces: (F,3) of the whole garment.
        counted: (n,) nodes whose edges count.
        height: of the plane, m.
    """
    edges = border_edges(faces, len(position))
    edges = edges[counted[edges].all(axis=1)]
    above = position[edges, 2] >= height
    cut = edges[above[:, 0] != above[:, 1]]
    if len(cut) != 2:
        return None
    a, b = _crossing(position, cut[:, 0], cut[:, 1], height)
    return float(np.linalg.norm(a - b))


def _crossing(x: FloatArray, first: IntArray, second: IntArray, height: float) -> FloatArray:
    """Returns (k,3) the points of edges at a height."""
    share = (height - x[first, 2]) / (x[second, 2] - x[first, 2])
    points: FloatArray = x[first] + share[:, None] * (x[second] - x[first])
    return points
