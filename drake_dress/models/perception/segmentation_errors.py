"""Errors of a segmentation: outlines that are off, and patches that are missed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from drake_dress.models.arrays import IntArray
from drake_dress.models.perception.smooth_noise import smooth_noise


@dataclass(frozen=True)
class SegmentationErrors:
    """Sizes of the errors; lengths are pixels of the image.

    Attributes:
        outline: standard deviation by which an outline is off.
        outline_width: distance along an outline over which it is off alike.
        missed: share of the image that is taken for background, in patches.
        patch_width: size of these patches.
    """

    outline: float = 1.5
    outline_width: float = 8.0
    missed: float = 0.02
    patch_width: float = 12.0


def segmented(
    labels: IntArray, errors: SegmentationErrors, rng: np.random.Generator, background: int = 0
) -> IntArray:
    """Returns (h,w) labels as a segmentation tells them.

    Args:
        labels: (h,w) true labels.
        errors: their sizes.
        rng: generator; it is advanced by the same number of draws for each image of a size.
        background: label of what is missed.
    """
    h, w = labels.shape
    off = [errors.outline * smooth_noise(rng, (h, w), errors.outline_width) for _ in range(2)]
    missed = smooth_noise(rng, (h, w), errors.patch_width) < ndtri(errors.missed)
    row = np.clip(np.rint(np.arange(h)[:, None] + off[0]), 0, h - 1).astype(np.intp)
    column = np.clip(np.rint(np.arange(w) + off[1]), 0, w - 1).astype(np.intp)
    told = labels[row, column]
    told[missed] = background
    return told
