"""The middle of the back of a garment's neck opening, which lies on the wearer's nape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.garment.edges import border_edges
from drake_dress.models.sides import SIDES

# Height of a shoulder seam's inner end above the shoulder tip, m: of shirts and jackets 3 to 5 cm.
_SHOULDER_SLOPE = 0.045


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

    Args:
        rest_position: (n,3) in the canonical rest pose of `GarmentMesh`, m.
        faces: (F,3).
        loops: nodes around armholes and cuffs.

    Returns:
        None if no edge above the armholes' centres crosses the middle.
    """
    x = rest_position.astype(np.float64)
    centers = np.stack([x[loops[f"{side}_armhole"]].mean(axis=0) for side in SIDES])
    tip = np.mean([x[loops[f"{side}_armhole"], 2].max() for side in SIDES])
    middle, low = centers.mean(axis=0)[1], centers[:, 2].max()
    border = border_edges(faces, len(x))
    y = x[border, 1] - middle
    rows = np.flatnonzero((y[:, 0] < 0.0) != (y[:, 1] < 0.0))
    share = y[rows, 0] / (y[rows, 0] - y[rows, 1])
    points = (1.0 - share)[:, None] * x[border[rows, 0]] + share[:, None] * x[border[rows, 1]]
    above = np.flatnonzero(points[:, 2] > low)
    if not len(above):
        return None
    k = above[np.argmin(points[above, 0])]
    weights = np.array([1.0 - share[k], share[k]])
    height = max(0.0, float(points[k, 2] - tip) - _SHOULDER_SLOPE)
    in_front = bool(points[k, 0] > centers.mean(axis=0)[0])
    return Nape(border[rows[k]], weights, height, in_front)
