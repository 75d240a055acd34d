"""What observations ask of the nodes of a garment, as weighted linear equations.

Observed points pull the surface toward themselves: firmly along its normal, and weakly across,
where cloth without texture does not show how far it has slid. Nodes that a camera sees through are
pulled in the image to where the garment is seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import KDTree

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.perception.depth_buffer import depth_buffer, pixel_indices, seen
from drake_dress.models.perception.point_cloud import Pinhole
from drake_dress.models.perception.vision import opencv

# Places within a triangle at which it is compared with points: its middle, and nearer to a corner.
_WITHIN = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / [[3], [6], [6], [6]]
# Pixels of the images in which it is looked up what the camera sees of the mesh are larger.
_COARSER = 2


@dataclass(frozen=True)
class PullSettings:
    """Weights and reach of the observations.

    Attributes:
        deviation: standard deviation of a point's distance from the surface, m.
        across: weight across the surface, as a share of that along its normal.
        reach: largest distance from a point to the surface that it pulls, m.
        robust: distance at which a point's weight is a quarter, as a share of the reach.
        depth: depth behind what a camera sees of the mesh at which it still counts as seen, m.
        through_depth: distance behind a node at which something must be seen through it, m.
        through_pixels: distance in the image from the garment at which a node is seen through.
        through_deviation: standard deviation of where the garment's outline is seen, m.
        through_reach: largest pull of a node that is seen through, m.
    """

    deviation: float = 0.012
    across: float = 0.1
    reach: float = 0.15
    robust: float = 0.5
    depth: float = 0.03
    through_depth: float = 0.08
    through_pixels: float = 4.0
    through_deviation: float = 0.03
    through_reach: float = 0.15


@dataclass(frozen=True)
class Pulls:
    """Equations `matrix` d = `residual` for displacements d (3n,) of the nodes, node by node.

    Attributes:
        matrix: (m,3n).
        residual: (m,), m.
        weight: (m,), 1/m².
    """

    matrix: sp.csr_array
    residual: FloatArray
    weight: FloatArray


def joined(pulls: Sequence[Pulls], count: int) -> Pulls:
    """Returns all equations of a garment of `count` nodes together."""
    if not pulls:
        return Pulls(sp.csr_array((0, 3 * count)), np.zeros(0), np.zeros(0))
    return Pulls(
        sp.csr_array(sp.vstack([each.matrix for each in pulls])),
        np.concatenate([each.residual for each in pulls]),
        np.concatenate([each.weight for each in pulls]),
    )


def to_points(
    camera: Pinhole,
    points: FloatArray,
    x: FloatArray,
    faces: IntArray,
    reach: float,
    settings: PullSettings,
) -> Pulls:
    """Returns the pulls of observed points on what their camera sees of the mesh.

    Args:
        camera: that sees the points.
        points: (k,3), m, world.
        x: (n,3) nodes, m.
        faces: (F,3).
        reach: largest distance that a point pulls over, m.
        settings: weights.
    """
    place, corner, share, normal = _samples(x, faces)
    coarse = camera.coarser(_COARSER)
    is_seen = seen(coarse, depth_buffer(coarse, x, faces), place, settings.depth)
    candidates = np.flatnonzero(is_seen)
    if len(candidates) == 0 or len(points) == 0:
        return joined([], len(x))
    far, nearest = KDTree(place[candidates]).query(points, distance_upper_bound=reach)
    found = np.isfinite(far)
    sample, residual = candidates[nearest[found]], points[found]
    residual = residual - place[sample]
    scale = settings.robust * reach
    # Geman and McClure's: points far off are mostly of another layer
    weight = 1.0 / (1.0 + (far[found] / scale) ** 2) ** 2 / settings.deviation**2
    n, corner, share, normal = len(x), corner[sample], share[sample], normal[sample]
    along = Pulls(
        _rows(corner, share[:, :, None] * normal[:, None, :], n),
        (residual * normal).sum(axis=1),
        weight,
    )
    each = [
        Pulls(
            _rows(corner, share[:, :, None] * axis, n),
            residual[:, k],
            settings.across * weight,
        )
        for k, axis in enumerate(np.eye(3))
    ]
    return joined([along, *each], n)


@dataclass(frozen=True)
class Outline:
    """Where a garment is in an image.

    Attributes:
        away: (h,w) distance of each pixel to the garment, pixels; inf without a garment.
        nearest: (h,w,2) column and row of the garment's nearest pixel.
    """

    away: FloatArray
    nearest: FloatArray

    @staticmethod
    def of(is_garment: BoolArray) -> Outline:
        """Returns the outline of the garment's pixels (h,w)."""
        if not is_garment.any():
            return Outline(np.full(is_garment.shape, np.inf), np.zeros((*is_garment.shape, 2)))
        cv2 = opencv()
        free = np.where(is_garment, 0, 1).astype(np.uint8)
        away, label = cv2.distanceTransformWithLabels(
            free, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
        )
        row, column = np.nonzero(is_garment)
        place = np.zeros((int(label.max()) + 1, 2))
        place[label[row, column]] = np.stack([column, row], axis=1)
        return Outline(np.asarray(away, dtype=float), place[label])


def out_of_free_space(
    camera: Pinhole, depth: FloatArray, outline: Outline, x: FloatArray, settings: PullSettings
) -> Pulls:
    """Returns the pulls on nodes that a camera sees through, toward the garment in the image.

    Args:
        camera: that sees.
        depth: (h,w) measured, m; 0 where nothing is within its range, or nothing was measured.
        outline: of the garment in the image.
        x: (n,3) nodes, m.
        settings: weights.
    """
    n = len(x)
    pixels, z = camera.pixels(x)
    place, inside = pixel_indices(camera, pixels, z)
    row, column = place[:, 1], place[:, 0]
    behind = (depth[row, column] > z + settings.through_depth) | (depth[row, column] == 0.0)
    through = inside & behind & (outline.away[row, column] > settings.through_pixels)
    through &= np.isfinite(outline.away[row, column])
    node = np.flatnonzero(through)
    if len(node) == 0:
        return joined([], n)
    off = outline.nearest[row[node], column[node]] - pixels[node]
    off *= (z[node] / camera.focal)[:, None]
    off *= np.minimum(1.0, settings.through_reach / np.linalg.norm(off, axis=1))[:, None]
    weight = np.full(len(node), settings.through_deviation**-2)
    alone, ones = node[:, None].astype(np.int32), np.ones((len(node), 1, 1))
    rows = [_rows(alone, ones * camera.rotation[:, k], n) for k in (0, 1)]
    return joined([Pulls(rows[k], off[:, k], weight) for k in (0, 1)], n)


def _samples(x: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray, FloatArray, FloatArray]:
    """Returns places (k,3) on the mesh, their corners (k,3) and shares (k,3), and normals (k,3)."""
    a, b, c = (x[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
    corner = np.repeat(faces, len(_WITHIN), axis=0)
    share = np.tile(_WITHIN, (len(faces), 1))
    place = np.einsum("ki,kij->kj", share, x[corner])
    return place, corner, share, np.repeat(normal, len(_WITHIN), axis=0)


def _rows(node: IntArray, value: FloatArray, count: int) -> sp.csr_array:
    """Returns a matrix (m,3n) with `value` (m,k,3) at the coordinates of `node` (m,k)."""
    m, k = node.shape
    column = 3 * node[:, :, None].astype(np.int64) + np.arange(3)
    start = np.arange(0, 3 * k * m + 1, 3 * k)
    return sp.csr_array((value.reshape(-1), column.reshape(-1), start), shape=(m, 3 * count))
