"""Errors of a depth camera and of what is made of its images."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from drake_dress.models.arrays import FloatArray
from drake_dress.models.perception.segmentation_errors import SegmentationErrors
from drake_dress.models.perception.stereo_errors import StereoErrors


@dataclass(frozen=True)
class CameraErrors:
    """Sizes of the errors.

    Attributes:
        stereo: errors of depth.
        segmentation: errors of labels.
        latency: time from an exposure until its images arrive, s.
        position: standard deviation of each coordinate of where the camera is believed to be, m.
        rotation_deg: standard deviation of how it is believed to be turned about each axis,
            degrees.
    """

    stereo: StereoErrors = field(default_factory=StereoErrors)
    segmentation: SegmentationErrors = field(default_factory=SegmentationErrors)
    latency: float = 0.07
    position: float = 0.003
    rotation_deg: float = 0.2


def drawn_pose_error(
    errors: CameraErrors, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Returns by how much a camera is turned (3,3), in its own frame, and moved (3,), m, world."""
    turned = Rotation.from_rotvec(np.radians(errors.rotation_deg) * rng.normal(size=3))
    return np.asarray(turned.as_matrix()), errors.position * rng.normal(size=3)
