"""Points on the surface of what a depth camera sees, without those that float at edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.perception.point_cloud import Pinhole, thinned
from drake_dress.models.perception.vision import opencv


@dataclass(frozen=True)
class PointSettings:
    """Which points are used.

    Attributes:
        jump: relative change of depth to a neighbour above which a pixel lies at an edge.
        spacing: distance to which points are thinned, m.
    """

    jump: float = 0.04
    spacing: float = 0.025


def surface_points(
    camera: Pinhole, depth: FloatArray, labels: IntArray, label: int, settings: PointSettings
) -> FloatArray:
    """Returns (k,3) thinned points of a label, m, world.

    Args:
        camera: as it is believed to stand.
        depth: (h,w) measured, m; 0 where there is none.
        labels: (h,w), from a segmentation.
        label: of the surface.
        settings: which points are used.
    """
    chosen = away_from_edges(depth, (labels == label) & (depth > 0.0), settings.jump)
    return thinned(camera.points(depth, chosen), settings.spacing)


def away_from_edges(depth: FloatArray, chosen: BoolArray, jump: float) -> BoolArray:
    """Returns (h,w) the chosen pixels whose eight neighbours are chosen and about as far away.

    Args:
        depth: (h,w), m, positive where chosen.
        chosen: (h,w).
        jump: largest relative difference of depth among them.
    """
    nearest, farthest = extremes_around(np.where(chosen, depth, 0.0))
    return np.asarray(chosen & (nearest > 0.0) & (farthest < (1.0 + jump) * nearest))


def extremes_around(depth: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns (h,w) the least and the greatest depth of each pixel and its eight neighbours, m."""
    cv2 = opencv()
    around = np.ones((3, 3), dtype=np.uint8)
    return np.asarray(cv2.erode(depth, around)), np.asarray(cv2.dilate(depth, around))
