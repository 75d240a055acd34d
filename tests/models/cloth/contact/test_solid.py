"""Closed meshes as fields of signed distances."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.distance import normal_derivative
from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles, Solid
from drake_dress.models.cloth.contact.signed_distance import SignedDistanceField
from drake_dress.models.cloth.contact.solid import make_signed_distance_field

RADIUS = 0.08


@pytest.fixture(scope="module")
def ball() -> SignedDistanceField:
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=RADIUS)
    return make_signed_distance_field(mesh.vertices, mesh.faces, 0.02)


def _alone(solid: Solid) -> Obstacles:
    return replace(Obstacles.none(), solids=(solid,))


def _around(rng: np.random.Generator, count: int) -> FloatArray:
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction * rng.uniform(0.6 * RADIUS, 1.8 * RADIUS, size=(count, 1))


def test_field_of_a_ball_is_that_of_the_sphere(ball: SignedDistanceField) -> None:
    x = _around(np.random.default_rng(0), 200)
    near = find_proximity(x, _alone(Solid(ball)), 0.0)
    size = np.linalg.norm(x, axis=1)
    np.testing.assert_allclose(near.gap, size - RADIUS, atol=4e-4)
    cosine = np.einsum("ij,ij->i", near.normal, x / size[:, None])
    assert cosine.min() > 0.998
    np.testing.assert_allclose(near.slope, 1.0, atol=0.03)


def test_far_from_the_mesh_the_distance_goes_on(ball: SignedDistanceField) -> None:
    near = find_proximity(np.array([[2.0, 0.0, 0.0]]), _alone(Solid(ball)), 0.0)
    assert near.gap[0] == pytest.approx(2.0 - RADIUS, rel=1e-3)


def test_solid_is_seen_alike_from_a_moved_frame(ball: SignedDistanceField) -> None:
    rng = np.random.default_rng(1)
    x = _around(rng, 50)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation *= np.sign(np.linalg.det(rotation))
    position = np.array([0.3, -0.2, 1.1])
    spin, speed = np.array([0.3, -1.0, 0.5]), np.array([0.1, 0.2, -0.3])
    here = find_proximity(x, _alone(Solid(ball)), 0.003)
    moved = Solid(ball, rotation, position, speed, spin)
    there = find_proximity(x @ rotation.T + position, _alone(moved), 0.003)
    np.testing.assert_allclose(there.gap, here.gap, atol=1e-12)
    np.testing.assert_allclose(there.normal, here.normal @ rotation.T, atol=1e-10)
    expected = speed + np.cross(spin, x @ rotation.T)
    np.testing.assert_allclose(there.surface_velocity, expected, atol=1e-12)


@pytest.mark.parametrize("kind", ["solid", "half_space", "capsule", "round_cone"])
def test_gap_and_normal_derivatives_match_finite_differences(
    ball: SignedDistanceField, kind: str
) -> None:
    rng = np.random.default_rng(2)
    x = _around(rng, 30)
    obstacles = {
        "solid": _alone(Solid(ball, position=np.array([0.01, 0.0, 0.0]))),
        "half_space": Obstacles.floor(-0.2),
        "capsule": Obstacles.resting(
            np.array([[-0.05, 0.0, 0.0]]), np.array([[0.05, 0.02, 0.0]]), np.array([0.03])
        ),
        "round_cone": Obstacles.resting(
            np.array([[-0.05, 0.0, 0.0]]), np.array([[0.05, 0.02, 0.0]]), np.array([[0.03, 0.05]])
        ),
    }[kind]
    near = find_proximity(x, obstacles, 0.003)
    bar, d, step = rng.normal(size=x.shape), rng.normal(size=x.shape), 1e-6
    high = find_proximity(x + step * d, obstacles, 0.003)
    low = find_proximity(x - step * d, obstacles, 0.003)
    gap_rate = (high.gap - low.gap) / (2.0 * step)
    along = near.slope * np.einsum("ij,ij->i", near.normal, d)
    np.testing.assert_allclose(gap_rate, along, rtol=1e-4, atol=1e-7)
    out = np.empty_like(x)
    normal_derivative(x, obstacles.packed, near.owner, near.normal, bar, out)
    rate = np.einsum("ij,ij->i", bar, (high.normal - low.normal) / (2.0 * step))
    np.testing.assert_allclose(np.einsum("ij,ij->i", out, d), rate, rtol=2e-4, atol=1e-5)


def test_nearest_of_all_kinds_owns_a_node(ball: SignedDistanceField) -> None:
    obstacles = Obstacles(
        np.array([[1.0, 0.0, 0.0]]),
        np.array([[1.0, 0.0, 0.0]]),
        np.array([0.05]),
        np.zeros((1, 3)),
        np.zeros((1, 3)),
        HalfSpaces.resting(np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 2.0])),
        (Solid(ball),),
    )
    x = np.array([[1.1, 0.0, 0.0], [0.5, 0.0, -0.9], [0.1, 0.0, 0.0]])
    near = find_proximity(x, obstacles, 0.0)
    assert near.owner.tolist() == [0, 1, 2]
    np.testing.assert_allclose(near.gap, [0.05, 0.1, 0.02], atol=4e-4)


def _open_box() -> trimesh.Trimesh:
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    return trimesh.Trimesh(box.vertices, box.faces[:-1], process=False)


def test_meshes_that_bound_nothing_are_told() -> None:
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    with pytest.raises(UserError, match="closed surface"):
        make_signed_distance_field(_open_box().vertices, _open_box().faces)
    with pytest.raises(UserError, match="outward"):
        make_signed_distance_field(box.vertices, box.faces[:, ::-1])
    with pytest.raises(UserError, match="finite"):
        make_signed_distance_field(box.vertices * np.nan, box.faces)
    with pytest.raises(UserError, match="at most"):
        make_signed_distance_field(box.vertices, box.faces, 1e-4)
