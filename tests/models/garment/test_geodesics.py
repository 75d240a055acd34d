"""Distances on the surface: exact where it is flat, and never exceeded however it is folded."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.geodesics import geodesic_distances, mean_distance, reach


def sheet(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    flat = np.concatenate([rng.uniform(0.0, 1.0, (200, 2)), corners])
    return np.column_stack([flat, np.zeros(len(flat))]), Delaunay(flat).simplices.astype(np.int32)


def test_on_a_flat_sheet_they_are_straight() -> None:
    x, faces = sheet(0)
    a, b = np.arange(5, dtype=np.int32), np.arange(40, 90, dtype=np.int32)
    straight = np.linalg.norm(x[a][:, None] - x[b], axis=2)
    np.testing.assert_allclose(geodesic_distances(x, faces, a, b), straight, rtol=1e-9)


def test_a_sheet_that_is_rolled_up_keeps_them() -> None:
    """Along the roll's axis and around it, a fine roll is as long as the flat sheet."""
    count = 61
    u, w = np.meshgrid(np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, count), indexing="ij")
    radius = 1.0 / np.pi
    x = np.stack([radius * np.cos(u / radius), radius * np.sin(u / radius), w], axis=-1)
    i, j = np.meshgrid(np.arange(count - 1), np.arange(count - 1), indexing="ij")
    corner = (i * count + j).ravel()
    faces = np.concatenate(
        [
            np.column_stack([corner, corner + count, corner + 1]),
            np.column_stack([corner + 1, corner + count, corner + count + 1]),
        ]
    ).astype(np.int32)
    ends = geodesic_distances(
        x.reshape(-1, 3), faces, np.array([0]), np.array([count - 1, count * (count - 1)])
    )[0]
    np.testing.assert_allclose(ends, [1.0, 1.0], rtol=1e-3)
    across = geodesic_distances(x.reshape(-1, 3), faces, np.array([0]), np.array([count**2 - 1]))
    assert across[0, 0] == pytest.approx(np.sqrt(2.0), rel=1e-3)


@given(seed=st.integers(0, 2**31))
@settings(max_examples=30)
def test_no_two_means_are_further_apart_than_their_cheapest_pairing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(7, 3)), rng.normal(size=(5, 3)) + 1.0
    of_a, of_b = rng.dirichlet(np.ones(7)), rng.dirichlet(np.ones(5))
    distance = np.linalg.norm(a[:, None] - b, axis=2)
    bound = mean_distance(distance, of_a, of_b)
    assert np.linalg.norm(of_a @ a - of_b @ b) <= bound + 1e-12
    assert bound <= of_a @ distance @ of_b + 1e-12


def test_points_on_a_line_reach_the_bound() -> None:
    along = np.array([1.0, 2.0, 4.0])
    distance = np.abs(along[:, None] - (along + 5.0))
    weight = np.array([0.5, 0.3, 0.2])
    assert mean_distance(distance, weight, weight) == pytest.approx(5.0)


@pytest.mark.parametrize("preset", sorted(COATS))
def test_a_coat_is_alike_on_both_sides_and_longer_than_straight(preset: str) -> None:
    mesh = make_coat(COATS[preset], 0.04)
    r = reach(mesh)
    centers = [
        mesh.rest_position[mesh.loops[f"{side}_armhole"]].mean(axis=0) for side in ("left", "right")
    ]
    held = [mesh.rest_position[mesh.grasp[side]].mean(axis=0) for side in ("left", "right")]
    assert r.between_sleeves > 0.98 * np.linalg.norm(centers[0] - centers[1])
    assert r.to_far_gripper[0] == pytest.approx(r.to_far_gripper[1], rel=0.03)
    assert r.to_far_gripper[0] > 0.98 * np.linalg.norm(centers[0] - held[1])
    assert r.to_near_gripper[0] > 0.98 * np.linalg.norm(centers[0] - held[0])
    assert r.to_near_gripper[0] < r.to_far_gripper[0]
    larger = reach(mesh.scaled(1.1))
    assert larger.between_sleeves == pytest.approx(1.1 * r.between_sleeves, rel=1e-9)
