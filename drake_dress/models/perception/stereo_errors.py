"""Errors of a depth camera that matches the images of two imagers side by side.

An error of the disparity d = f b / z (f focal length, pixels; b baseline) becomes an error of depth
that grows with z². Depth is lost where only one imager sees a surface, where a surface is seen at a
grazing angle, and in patches without contrast; at the edge of a surface, some pixels float between
it and what is behind. Theory of stereo depth and typical sizes: Grunnet-Jepsen, Sweetser and
Woodfill, Best-Known-Methods for Tuning Intel RealSense D400 Depth Cameras (2018).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.perception.smooth_noise import smooth_noise
from drake_dress.models.perception.surface_points import extremes_around


@dataclass(frozen=True)
class StereoErrors:
    """Sizes of the errors; lengths in pixels are those of the depth image.

    Attributes:
        baseline: distance between both imagers, m. The second one is to the right.
        disparity_noise: standard deviation of the disparity's error, pixels.
        noise_width: distance over which neighbours share their error, pixels: that of the windows
            that are matched.
        disparity_step: step in which disparity is told, pixels; 0 for none.
        grazing_deg: angle between ray and surface normal beyond which depth is lost, degrees.
        grazing_spread_deg: standard deviation of that angle over the image, degrees.
        jump: relative change of depth between neighbours that is an edge.
        flying: share of pixels at an edge that float between both surfaces.
        edge_loss: share of pixels at an edge without depth.
        missing: share of the image without depth for want of contrast, in patches.
        patch_width: size of these patches, pixels.
        nearest: least depth that is measured, m.
        farthest: greatest depth that is measured, m.
    """

    baseline: float = 0.05
    disparity_noise: float = 0.08
    noise_width: float = 1.5
    disparity_step: float = 1.0 / 32.0
    grazing_deg: float = 75.0
    grazing_spread_deg: float = 4.0
    jump: float = 0.03
    flying: float = 0.3
    edge_loss: float = 0.3
    missing: float = 0.01
    patch_width: float = 6.0
    nearest: float = 0.2
    farthest: float = 5.0


def measured_depth(
    depth: FloatArray, focal: float, errors: StereoErrors, rng: np.random.Generator
) -> FloatArray:
    """Returns (h,w) measured depth, m; 0 where there is none.

    Args:
        depth: (h,w) true depth along the optical axis, m; 0, inf or nan where nothing is.
        focal: focal length of the image, pixels.
        errors: their sizes.
        rng: generator; it is advanced by the same number of draws for each image of a size.
    """
    shape = depth.shape
    noise = smooth_noise(rng, shape, errors.noise_width)
    tolerance = smooth_noise(rng, shape, errors.patch_width)
    contrast = smooth_noise(rng, shape, errors.patch_width)
    fate, mix = rng.random(shape), rng.random(shape)

    seen = np.isfinite(depth) & (depth > 0.0)
    z = np.where(seen, depth, errors.farthest * 10.0)
    lost = ~seen | shadowed(z, focal * errors.baseline)
    largest = np.radians(errors.grazing_deg + errors.grazing_spread_deg * tolerance)
    near, far = extremes_around(z)
    edge = far > (1.0 + errors.jump) * near
    # across an edge there is no surface whose angle could be taken
    lost |= ~edge & (np.cos(largest) > cosine_of_rays(z, focal))
    lost |= contrast < ndtri(errors.missing)
    lost |= edge & (fate < errors.edge_loss)
    flying = edge & (fate > 1.0 - errors.flying)
    z = np.where(flying, near + mix * (far - near), z)
    disparity = focal * errors.baseline / z + errors.disparity_noise * noise
    if errors.disparity_step > 0.0:
        disparity = np.round(disparity / errors.disparity_step) * errors.disparity_step
    with np.errstate(divide="ignore"):
        z = focal * errors.baseline / disparity
    lost |= (z < errors.nearest) | (z > errors.farthest)
    return np.where(lost, 0.0, z)


def shadowed(depth: FloatArray, strength: float) -> BoolArray:
    """Returns (h,w) what the second imager, to the right, does not see.

    Args:
        depth: (h,w), m, positive.
        strength: focal length times baseline, pixels times m.
    """
    column = np.arange(depth.shape[1]) - strength / depth
    # a point is hidden by a nearer one to its right that the second imager sees left of it
    leftmost = np.minimum.accumulate(column[:, ::-1], axis=1)[:, ::-1]
    hidden = np.zeros(depth.shape, dtype=bool)
    hidden[:, :-1] = leftmost[:, 1:] < column[:, :-1]
    return hidden


def cosine_of_rays(depth: FloatArray, focal: float) -> FloatArray:
    """Returns (h,w) the cosine between ray and surface normal, from differences of depth.

    Args:
        depth: (h,w), m, positive.
        focal: focal length, pixels; the optical axis meets the middle of the image.
    """
    h, w = depth.shape
    u = (np.arange(w) - 0.5 * (w - 1)) / focal
    v = ((np.arange(h) - 0.5 * (h - 1)) / focal)[:, None]
    down, right = np.gradient(depth)
    # points are z (u, v, 1); the normal is the cross product of both tangents, times focal / z
    x, y = -focal * right, -focal * down
    z = depth + focal * (u * right + v * down)
    # the normal times the ray (u, v, 1) is the depth
    return np.asarray(depth / np.sqrt((x**2 + y**2 + z**2) * (u**2 + v**2 + 1.0)))
