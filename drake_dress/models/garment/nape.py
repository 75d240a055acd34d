"""The middle of the back of a garment's neck opening, which lies on the wearer's nape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.garment.edges import border_edges, unique_edges
from drake_dress.models.sides import SIDES

# Height of a shoulder seam's inner end above the shoulder tip, m: of shirts and jackets 3 to 5 cm.
_SHOULDER_SLOPE = 0.045
# Height above that end from which on the edge is a hood's, m: no collar is as high.
_HOOD = 0.15


@dataclass(frozen=True)
class Nape:
    """A point on an edge of a garment.

    Attributes:
        nodes: (2,) ends of the edge; weights: (2,) of both, sum 1.
        height: of the point above the inner ends of the shoulder seams at rest, m: that of the
            collar; 0 if there is none.
        in_front: whether it is in front of the armholes, as in a garment that opens at the back.
    """

    nodes: IndexArray
    weights: FloatArray
    height: float
    in_front: bool = False

    def at(self, x: FloatArray) -> FloatArray:
        """Returns the point (3,) of nodes `x` (n,3), m."""
        point: FloatArray = self.weights @ x[self.nodes]
        return point


def find_nape(
    rest_position: FloatArray,
    faces: npt.NDArray[np.integer],
    loops: Mapping[str, npt.NDArray[np.integer]],
) -> Nape | None:
    """Returns the rearmost point of the neck's edge midway between the armholes.

    That of a hood is where it begins, at the height of the shoulder seams' inner ends.

    Args:
        rest_position: (n,3) in the canonical rest pose of `GarmentMesh`, m.
        faces: (F,3).
        loops: nodes around armholes and cuffs.

    Returns:
        None if no edge above the armholes' centres crosses the middle.
    """
    x = rest_position.astype(np.float64)
    centers = np.stack([x[loops[f"{side}_armhole"]].mean(axis=0) for side in SIDES])
    neck = np.mean([x[loops[f"{side}_armhole"], 2].max() for side in SIDES]) + _SHOULDER_SLOPE
    middle, low = centers.mean(axis=0), centers[:, 2].max()
    edges, weights, points = _crossing(x, border_edges(faces, len(x)), middle[1])
    above = np.flatnonzero(points[:, 2] > low)
    if not len(above):
        return None
    k = above[np.argmin(points[above, 0])]
    height = max(0.0, float(points[k, 2] - neck))
    if height > _HOOD:
        edges, weights, points = _crossing(x, unique_edges(faces), middle[1])
        behind = np.flatnonzero(points[:, 0] < middle[0])
        k, height = behind[np.argmin(np.abs(points[behind, 2] - neck))], 0.0
    return Nape(edges[k], weights[k], height, bool(points[k, 0] > middle[0]))


def _crossing(
    x: FloatArray, edges: npt.NDArray[np.integer], middle: float
) -> tuple[IndexArray, FloatArray, FloatArray]:
    """Returns the edges (k,2) that cross the middle, weights (k,2) of their ends there, and points.

    Args:
        x: (n,3) nodes, m.
        edges: (E,2) nodes of edges.
        middle: y of the middle, m.
    """
    y = x[edges, 1] - middle
    rows = np.flatnonzero((y[:, 0] < 0.0) != (y[:, 1] < 0.0))
    share = y[rows, 0] / (y[rows, 0] - y[rows, 1])
    weights = np.stack([1.0 - share, share], axis=1)
    ends = edges[rows].astype(np.intp)
    return ends, weights, np.einsum("ki,kij->kj", weights, x[ends])
