"""Noise over an image whose neighbours are alike."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.perception.vision import opencv


def smooth_noise(rng: np.random.Generator, shape: tuple[int, ...], width: float) -> FloatArray:
    """Returns (h,w) normally distributed noise of mean 0 and standard deviation 1.

    White noise is blurred by a Gaussian and scaled back; at the border, it is mirrored.

    Args:
        rng: generator; it is advanced by h w normal numbers.
        shape: (h,w).
        width: standard deviation of the Gaussian, pixels; 0 for white noise.
    """
    noise = rng.standard_normal(shape, dtype=np.float32)
    if width > 0.0:
        cv2 = opencv()
        noise = np.asarray(
            cv2.GaussianBlur(noise, (0, 0), width, borderType=cv2.BORDER_REFLECT), np.float32
        )
        noise /= _gain(width)
    return noise.astype(float)


def _gain(width: float) -> float:
    """Returns the standard deviation that the Gaussian of OpenCV leaves of white noise."""
    size = 2 * round(4 * width) + 1
    kernel = opencv().getGaussianKernel(max(size, 3), width)
    return float(np.sum(kernel**2))
