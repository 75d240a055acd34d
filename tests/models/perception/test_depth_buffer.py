import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drake_dress.models.perception.depth_buffer import depth_buffer, pixel_indices, seen
from drake_dress.models.perception.point_cloud import Pinhole


def camera_at(distance: float, seed: int) -> Pinhole:
    """A camera that looks at the origin from a drawn direction."""
    rotation = Rotation.random(random_state=seed).as_matrix()
    return Pinhole(80, 60, 70.0, rotation, -distance * rotation[:, 2])


@given(st.integers(0, 2**31 - 1), st.floats(1.5, 4.0))
def test_a_sphere_is_seen_at_the_depth_of_its_near_side(seed: int, distance: float) -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.5)
    camera = camera_at(distance, seed)
    buffer = depth_buffer(camera, ball.vertices, ball.faces)
    rays = camera.rays()
    length = np.linalg.norm(rays, axis=-1)
    ahead = rays @ camera.rotation[:, 2] * distance / length
    aside = np.sqrt(distance**2 - ahead**2)
    hits = aside < 0.48
    expected = (ahead - np.sqrt(np.clip(0.25 - aside**2, 0.0, None))) / length
    np.testing.assert_allclose(buffer[hits], expected[hits], atol=0.012)
    assert np.isinf(buffer[aside > 0.5]).all()


@given(st.integers(0, 2**31 - 1))
def test_the_half_of_a_sphere_that_faces_the_camera_is_seen(seed: int) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    camera = camera_at(3.0, seed)
    buffer = depth_buffer(camera, ball.vertices, ball.faces)
    facing = (ball.vertices * (camera.position - ball.vertices)).sum(axis=1)
    told = seen(camera, buffer, ball.vertices, tolerance=0.03)
    # half a pixel is 2 cm there: near the outline, the surface is too steep for the tolerance
    assert told[facing > 0.8].all()
    assert not told[facing < -1.0].any()


def test_the_order_of_triangles_does_not_matter_and_both_sides_are_seen() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    camera = camera_at(2.0, 1)
    one = depth_buffer(camera, ball.vertices, ball.faces)
    other = depth_buffer(camera, ball.vertices, ball.faces[::-1, ::-1])
    np.testing.assert_allclose(one, other, rtol=1e-12)


def test_what_is_behind_or_beside_the_camera_is_not_seen() -> None:
    camera = Pinhole(80, 60, 70.0, np.eye(3), np.zeros(3))
    triangle = np.array([[-9.0, -9.0, -2.0], [9.0, -9.0, -2.0], [0.0, 9.0, -2.0]])
    buffer = depth_buffer(camera, triangle, np.array([[0, 1, 2]], dtype=np.int32))
    assert np.isinf(buffer).all()
    points = np.array([[0.0, 0.0, -2.0], [5.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    np.testing.assert_array_equal(seen(camera, buffer, points), [False, False, True, False])
    place, _ = pixel_indices(camera, *camera.pixels(points))
    assert place.min() >= 0
    assert (place <= [79, 59]).all()


@pytest.mark.parametrize("factor", [1, 2, 4])
def test_a_coarser_camera_sees_the_same(factor: int) -> None:
    camera = camera_at(3.0, 5)
    coarse = camera.coarser(factor)
    points = np.random.default_rng(0).normal(scale=0.3, size=(50, 3))
    for one, other, size in zip(
        camera.pixels(points)[0].T, coarse.pixels(points)[0].T, (80, 60), strict=True
    ):
        # from the edge of the image, in shares of its size
        np.testing.assert_allclose((one + 0.5) / size, (other + 0.5) * factor / size, rtol=1e-9)
