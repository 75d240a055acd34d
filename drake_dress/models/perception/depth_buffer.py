"""The depth at which a camera sees a mesh, and which of its points it sees."""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.perception.point_cloud import Pinhole

_NEAREST = 0.05  # m; triangles that reach nearer are not drawn


def depth_buffer(camera: Pinhole, vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Returns (h,w) the depth of the nearest triangle in each pixel, m; inf where there is none.

    Args:
        camera: that looks at the mesh.
        vertices: (n,3), m, world.
        faces: (F,3) triangles, seen from both sides.
    """
    pixels, z = camera.pixels(vertices)
    buffer = np.full((camera.height, camera.width), np.inf)
    _draw(np.ascontiguousarray(pixels), z, np.ascontiguousarray(faces), buffer)
    return buffer


def seen(
    camera: Pinhole, buffer: FloatArray, points: FloatArray, tolerance: float = 0.0
) -> BoolArray:
    """Returns (n,) whether points are in the image and not behind what was drawn.

    Args:
        camera: of the buffer.
        buffer: (h,w), from `depth_buffer`.
        points: (n,3), m, world.
        tolerance: depth behind the surface at which a point still counts as on it, m.
    """
    pixels, z = camera.pixels(points)
    place, inside = pixel_indices(camera, pixels, z)
    return np.asarray(inside & (z <= buffer[place[:, 1], place[:, 0]] + tolerance))


def pixel_indices(
    camera: Pinhole, pixels: FloatArray, depth: FloatArray
) -> tuple[IntArray, BoolArray]:
    """Returns (n,2) column and row of the nearest pixels, and whether the points are in the image.

    Indices of points outside are those of the nearest pixel at the border.

    Args:
        camera: that looks at the points.
        pixels: (n,2), from `Pinhole.pixels`.
        depth: (n,), m.
    """
    most = np.array([camera.width - 1, camera.height - 1])
    place = np.rint(np.nan_to_num(pixels, nan=-1.0, posinf=-1.0, neginf=-1.0))
    inside = (depth > _NEAREST) & (place >= 0).all(axis=1) & (place <= most).all(axis=1)
    return np.clip(place, 0, most).astype(np.int32), inside


@nb.njit(cache=True, nogil=True)
def _draw(pixels, z, faces, buffer):  # type: ignore[no-untyped-def]
    h, w = buffer.shape
    for f in range(len(faces)):
        a, b, c = faces[f]
        if min(z[a], z[b], z[c]) < _NEAREST:
            continue
        ax, ay = pixels[a]
        bx, by = pixels[b]
        cx, cy = pixels[c]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0.0:
            continue
        first_row = max(0, int(np.ceil(min(ay, by, cy))))
        last_row = min(h - 1, int(np.floor(max(ay, by, cy))))
        first = max(0, int(np.ceil(min(ax, bx, cx))))
        last = min(w - 1, int(np.floor(max(ax, bx, cx))))
        for row in range(first_row, last_row + 1):
            for column in range(first, last + 1):
                u = ((column - ax) * (cy - ay) - (cx - ax) * (row - ay)) / area
                v = ((bx - ax) * (row - ay) - (column - ax) * (by - ay)) / area
                if u < 0.0 or v < 0.0 or u + v > 1.0:
                    continue
                # 1/z is linear in the image
                depth = 1.0 / ((1.0 - u - v) / z[a] + u / z[b] + v / z[c])
                buffer[row, column] = min(buffer[row, column], depth)
