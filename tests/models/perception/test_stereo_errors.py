from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.perception.stereo_errors import (
    StereoErrors,
    cosine_of_rays,
    measured_depth,
    shadowed,
)

FOCAL = 450.0
H, W = 240, 320
NONE = StereoErrors(
    disparity_noise=0.0,
    disparity_step=0.0,
    grazing_deg=90.0,
    grazing_spread_deg=0.0,
    flying=0.0,
    edge_loss=0.0,
    missing=0.0,
)


def wall(z: float) -> FloatArray:
    return np.full((H, W), z)


def measured(depth: FloatArray, errors: StereoErrors, seed: int = 0) -> FloatArray:
    return measured_depth(depth, FOCAL, errors, np.random.default_rng(seed))


def plane(normal: FloatArray, distance: float) -> FloatArray:
    """Depth of a plane whose normal (3,) points to the camera; its middle is at `distance`."""
    u = (np.arange(W) - 0.5 * (W - 1)) / FOCAL
    v = ((np.arange(H) - 0.5 * (H - 1)) / FOCAL)[:, None]
    return distance * normal[2] / (normal[0] * u + normal[1] * v + normal[2])


def test_without_errors_depth_stays() -> None:
    np.testing.assert_allclose(measured(wall(1.3), NONE), 1.3, rtol=1e-12)


@given(st.floats(0.5, 2.0), st.floats(0.02, 0.2))
def test_noise_grows_with_the_square_of_depth(z: float, noise: float) -> None:
    errors = replace(NONE, disparity_noise=noise)
    deviation = [measured(wall(d), errors).std() for d in (z, 2.0 * z)]
    assert deviation[0] == pytest.approx(z**2 * noise / (FOCAL * errors.baseline), rel=0.08)
    assert deviation[1] / deviation[0] == pytest.approx(4.0, rel=0.08)


def test_depth_is_told_in_steps_of_disparity() -> None:
    depth = measured(np.linspace(1.0, 1.2, H * W).reshape(H, W), replace(NONE, disparity_step=0.25))
    disparity = FOCAL * NONE.baseline / depth
    np.testing.assert_allclose(disparity / 0.25, np.round(disparity / 0.25), atol=1e-9)
    assert len(np.unique(np.round(disparity, 6))) > 5


@given(st.floats(0.6, 1.2), st.floats(1.5, 3.0))
def test_beside_a_near_surface_one_imager_does_not_see_what_is_behind(
    near: float, far: float
) -> None:
    depth = wall(far)
    depth[:, 150:200] = near
    hidden = shadowed(depth, FOCAL * NONE.baseline)
    width = FOCAL * NONE.baseline * (1.0 / near - 1.0 / far)
    columns = np.flatnonzero(hidden.all(axis=0))
    np.testing.assert_array_equal(hidden.any(axis=0), hidden.all(axis=0))
    # the second imager is at the right: the shadow lies at the left of the surface
    assert columns.max() == 149
    assert len(columns) == pytest.approx(width, abs=1.001)
    np.testing.assert_array_equal(measured(depth, NONE) == 0.0, hidden)


@given(st.floats(0.0, 80.0), st.floats(0.0, 2.0 * np.pi))
def test_angles_of_a_plane_are_those_of_its_normal(tilt: float, around: float) -> None:
    t = np.radians(tilt)
    normal = -np.array([np.sin(t) * np.cos(around), np.sin(t) * np.sin(around), np.cos(t)])
    depth = plane(normal, 1.5)
    told = cosine_of_rays(np.where(depth > 0.0, depth, 1e3), FOCAL)
    middle = slice(H // 2 - 4, H // 2 + 4), slice(W // 2 - 4, W // 2 + 4)
    np.testing.assert_allclose(told[middle], np.cos(t), atol=0.02)


def test_surfaces_seen_at_a_grazing_angle_are_lost() -> None:
    errors = replace(NONE, grazing_deg=70.0)
    for tilt, share in ((60.0, 1.0), (80.0, 0.0)):
        t = np.radians(tilt)
        depth = plane(-np.array([0.0, np.sin(t), np.cos(t)]), 1.5)
        middle = measured(depth, errors)[H // 2 - 4 : H // 2 + 4]
        assert np.mean(middle > 0.0) == share


def test_pixels_float_between_both_surfaces_of_an_edge_and_nowhere_else() -> None:
    depth = wall(2.0)
    depth[80:160, :] = 1.0
    told = measured(depth, replace(NONE, flying=0.5))
    changed = np.abs(told - depth) > 1e-9
    rows = np.flatnonzero(changed.any(axis=1))
    np.testing.assert_array_equal(rows, [79, 80, 159, 160])
    assert changed[rows].mean() == pytest.approx(0.5, abs=0.1)
    assert told[changed].min() >= 1.0
    assert told[changed].max() <= 2.0
    assert told[changed].std() > 0.2
    lost = measured(depth, replace(NONE, edge_loss=0.4)) == 0.0
    assert lost[rows].mean() == pytest.approx(0.4, abs=0.1)
    assert not np.delete(lost, rows, axis=0).any()


def test_a_share_of_the_image_has_no_depth() -> None:
    errors = replace(NONE, missing=0.1, patch_width=2.0)
    assert np.mean(measured(wall(1.0), errors) == 0.0) == pytest.approx(0.1, abs=0.03)


def test_nothing_is_measured_where_nothing_is_or_out_of_range() -> None:
    depth = wall(1.0)
    depth[:40], depth[40:80], depth[80:120] = 0.0, np.inf, np.nan
    depth[120:160], depth[160:200] = 0.1, 6.0
    told = measured(depth, replace(NONE, baseline=1e-4))
    assert (told[:200] == 0.0).all()
    np.testing.assert_allclose(told[202:], 1.0, rtol=1e-9)


def test_the_seed_decides_and_sizes_do_not_change_the_number_of_draws() -> None:
    depth = wall(1.5)
    depth[50:90, 50:90] = 1.0
    errors = StereoErrors()
    np.testing.assert_array_equal(measured(depth, errors, 4), measured(depth, errors, 4))
    assert (measured(depth, errors, 4) != measured(depth, errors, 5)).any()
    one, two = (np.random.default_rng(1) for _ in range(2))
    measured_depth(depth, FOCAL, errors, one)
    measured_depth(depth, FOCAL, NONE, two)
    assert one.random() == two.random()
