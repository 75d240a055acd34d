"""Points of depth images: back-projection through a pinhole camera, and thinning."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray


@dataclass(frozen=True)
class Pinhole:
    """A camera without distortion, of square pixels, whose axis meets the middle of the image.

    Attributes:
        width, height: of the image, pixels.
        focal: focal length, pixels.
        rotation: R_WC (3,3): z ahead, y down, x to the right in the image.
        position: p_WC (3,), m.
    """

    width: int
    height: int
    focal: float
    rotation: FloatArray
    position: FloatArray

    def rays(self) -> FloatArray:
        """Returns (h,w,3) the direction of each pixel in the world, of length 1 along the axis."""
        u = (np.arange(self.width) - 0.5 * (self.width - 1)) / self.focal
        v = (np.arange(self.height) - 0.5 * (self.height - 1)) / self.focal
        x, y = np.meshgrid(u, v)
        return np.stack([x, y, np.ones_like(x)], axis=-1) @ self.rotation.T

    def points(self, depth: FloatArray, chosen: BoolArray) -> FloatArray:
        """Returns (n,3) the points of the chosen pixels, m, world, row by row.

        Args:
            depth: (h,w) along the axis, m.
            chosen: (h,w) pixels.
        """
        row, column = np.nonzero(chosen)
        z = depth[row, column]
        x = (column - 0.5 * (self.width - 1)) * z / self.focal
        y = (row - 0.5 * (self.height - 1)) * z / self.focal
        return np.stack([x, y, z], axis=1) @ self.rotation.T + self.position

    def pixels(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns where points (n,3), m, world, are seen, (n,2) column and row, and at which depth.

        Points behind the camera have a depth below zero, and pixels of no meaning.
        """
        seen = (points - self.position) @ self.rotation
        z = seen[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            off = self.focal * seen[:, :2] / z[:, None]
        middle = np.array([0.5 * (self.width - 1), 0.5 * (self.height - 1)])
        return off + middle, z

    def coarser(self, factor: int) -> Pinhole:
        """Returns the camera with pixels that are larger by a factor."""
        size = self.width // factor, self.height // factor
        return Pinhole(*size, self.focal / factor, self.rotation, self.position)

    def moved(self, rotation: FloatArray, translation: FloatArray) -> Pinhole:
        """Returns the camera turned about its own position and moved.

        Args:
            rotation: (3,3), in the world.
            translation: (3,), m, world.
        """
        return Pinhole(
            self.width,
            self.height,
            self.focal,
            rotation @ self.rotation,
            self.position + translation,
        )


def thinned(points: FloatArray, size: float) -> FloatArray:
    """Returns (m,3) one point for each cube of a grid that has points: their mean.

    Args:
        points: (n,3), m.
        size: edge of the cubes, m.
    """
    if len(points) == 0:
        return points
    cell = np.floor(points / size).astype(np.int64)
    cell -= cell.min(axis=0)
    extent = cell.max(axis=0) + 1
    key = (cell[:, 0] * extent[1] + cell[:, 1]) * extent[2] + cell[:, 2]
    _, which, count = np.unique(key, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(which, points[:, k], len(count)) for k in range(3)], axis=1)
    return np.asarray(sums / count[:, None])
