from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.perception.point_cloud import Pinhole
from drake_dress.models.perception.stereo_errors import StereoErrors, measured_depth
from drake_dress.models.perception.surface_points import (
    PointSettings,
    away_from_edges,
    surface_points,
)

CAMERA = Pinhole(160, 120, 140.0, np.eye(3), np.zeros(3))
SETTINGS = PointSettings()


@given(st.floats(0.8, 1.5), st.floats(2.0, 3.0), st.integers(0, 2**32 - 1))
def test_no_point_floats_between_two_surfaces(near: float, far: float, seed: int) -> None:
    depth = np.full((120, 160), far)
    depth[30:90, 40:120] = near
    labels = np.ones((120, 160), dtype=np.int32)
    noiseless = replace(StereoErrors(), disparity_noise=0.0, disparity_step=0.0, missing=0.0)
    told = measured_depth(depth, CAMERA.focal, noiseless, np.random.default_rng(seed))
    points = surface_points(CAMERA, told, labels, 1, SETTINGS)
    assert len(points) > 100
    off = np.minimum(np.abs(points[:, 2] - near), np.abs(points[:, 2] - far))
    assert off.max() < 0.02


def test_only_points_of_the_label_are_taken_and_they_lie_on_the_surface() -> None:
    depth = np.full((120, 160), 2.0)
    labels = np.zeros((120, 160), dtype=np.int32)
    labels[20:60, 30:90] = 3
    points = surface_points(CAMERA, depth, labels, 3, SETTINGS)
    pixels, z = CAMERA.pixels(points)
    np.testing.assert_allclose(z, 2.0)
    assert pixels.min(axis=0)[0] >= 30
    assert pixels.max(axis=0)[0] <= 89
    assert len(surface_points(CAMERA, depth, labels, 7, SETTINGS)) == 0
    # about one point for each cell of the grid
    area = np.prod([59, 39]) * (2.0 / CAMERA.focal) ** 2
    assert 0.7 < len(points) * SETTINGS.spacing**2 / area < 1.5


def test_pixels_beside_others_that_are_not_chosen_or_at_another_depth_are_left_out() -> None:
    depth = np.full((9, 12), 1.0)
    depth[:, 6:] = 1.5
    chosen = np.ones((9, 12), dtype=bool)
    chosen[0] = False
    kept = away_from_edges(depth, chosen, 0.04)
    np.testing.assert_array_equal(np.flatnonzero(kept.any(axis=1)), range(2, 9))
    np.testing.assert_array_equal(
        np.flatnonzero(kept.any(axis=0)), [0, 1, 2, 3, 4, 7, 8, 9, 10, 11]
    )
