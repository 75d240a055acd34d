import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drake_dress.models.arrays import FloatArray
from drake_dress.models.perception.point_cloud import Pinhole, thinned


def drawn_camera(seed: int) -> Pinhole:
    rng = np.random.default_rng(seed)
    rotation = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    return Pinhole(64, 48, float(rng.uniform(30, 90)), rotation, rng.normal(size=3))


@given(st.integers(0, 2**32 - 1))
def test_points_are_seen_at_the_pixels_that_they_come_from(seed: int) -> None:
    camera, rng = drawn_camera(seed), np.random.default_rng(seed)
    depth = rng.uniform(0.3, 4.0, (48, 64))
    chosen = rng.random((48, 64)) < 0.3
    points = camera.points(depth, chosen)
    pixels, z = camera.pixels(points)
    row, column = np.nonzero(chosen)
    np.testing.assert_allclose(pixels, np.stack([column, row], axis=1), atol=1e-8)
    np.testing.assert_allclose(z, depth[chosen], rtol=1e-12)
    np.testing.assert_allclose(
        points, camera.position + depth[chosen][:, None] * camera.rays()[chosen], atol=1e-12
    )


@given(st.integers(0, 2**32 - 1))
def test_a_camera_that_moves_with_the_scene_sees_the_same(seed: int) -> None:
    camera, rng = drawn_camera(seed), np.random.default_rng(seed)
    turn = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    shift = rng.normal(size=3)
    points = rng.normal(size=(20, 3)) + camera.position
    there = camera.position + shift + (points - camera.position) @ turn.T
    for one, other in zip(
        camera.pixels(points), camera.moved(turn, shift).pixels(there), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-6)


def test_points_behind_a_camera_have_a_negative_depth() -> None:
    camera = Pinhole(64, 48, 50.0, np.eye(3), np.zeros(3))
    assert camera.pixels(np.array([[0.1, 0.2, -1.0]]))[1][0] == -1.0


@given(st.integers(1, 400), st.floats(0.01, 0.5), st.integers(0, 2**32 - 1))
def test_each_cube_keeps_the_mean_of_its_points(count: int, size: float, seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(count, 3))
    cells: dict[tuple[float, ...], list[FloatArray]] = {}
    for point in points:
        cells.setdefault(tuple(np.floor(point / size)), []).append(point)
    expected = sorted(tuple(np.mean(each, axis=0)) for each in cells.values())
    np.testing.assert_allclose(sorted(map(tuple, thinned(points, size))), expected, atol=1e-12)


def test_no_points_stay_no_points() -> None:
    assert thinned(np.zeros((0, 3)), 0.01).shape == (0, 3)
