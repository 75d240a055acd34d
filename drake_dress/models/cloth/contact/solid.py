"""A closed mesh as a smooth signed distance field.

The distance is sampled once on a grid and interpolated by a cubic B-spline, which is twice
differentiable: normals do not jump from face to face, and their derivative, which the adjoint of a
contact step needs, exists everywhere. A look-up costs the same for any mesh.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import trimesh
from scipy import ndimage

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.signed_distance import SignedDistanceField

# Least distance that the grid extends beyond the mesh, m: distances are needed before contact.
_PADDING = 0.10
_MOST_CELLS = 20_000_000
# Number of points per distance query, which takes some hundred bytes a point.
_BATCH = 50_000


def make_signed_distance_field(
    vertices: FloatArray, faces: npt.NDArray[np.integer], spacing: float = 0.01
) -> SignedDistanceField:
    """Returns the field of a closed mesh.

    Args:
        vertices: (n,3) in the body's frame, m.
        faces: (F,3), consistently oriented, outward.
        spacing: spacing of the grid, m; smaller details are rounded.

    Raises:
        UserError: the mesh is not closed or not finite, or the grid would be too large.
    """
    mesh = trimesh.Trimesh(np.asarray(vertices, dtype=np.float64), faces, process=False)
    if not np.isfinite(mesh.vertices).all():
        raise UserError("solid", "vertices", "are not all finite, expected numbers in m")
    if not mesh.is_watertight:
        raise UserError("solid", "faces", "leave the mesh open, expected a closed surface")
    if mesh.volume <= 0.0:
        raise UserError("solid", "faces", "are oriented inward, expected outward normals")
    low = mesh.bounds[0] - _PADDING - 2.0 * spacing
    shape = np.ceil((mesh.bounds[1] + _PADDING + 2.0 * spacing - low) / spacing).astype(int) + 1
    if int(np.prod(shape)) > _MOST_CELLS:
        raise UserError(
            "solid",
            "spacing",
            f"is {spacing} m: {int(np.prod(shape))} grid nodes, expected at most {_MOST_CELLS}",
        )
    grid = np.stack(np.meshgrid(*(np.arange(k) for k in shape), indexing="ij"), axis=-1)
    points = low + spacing * grid.reshape(-1, 3)
    distance = np.empty(len(points))
    for begin in range(0, len(points), _BATCH):
        part = slice(begin, begin + _BATCH)
        # trimesh distances are positive inside
        distance[part] = -trimesh.proximity.signed_distance(mesh, points[part])
    coefficients = ndimage.spline_filter(distance.reshape(tuple(shape)), order=3, mode="mirror")
    return SignedDistanceField(low, float(spacing), np.ascontiguousarray(coefficients))
