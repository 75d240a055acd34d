import numpy as np
import pytest
import scipy.sparse as sp

from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.garment.transfer import barycentric_transfer


@pytest.fixture(scope="module")
def fine() -> GarmentMesh:
    return make_coat(CoatParameters(), 0.02)


@pytest.fixture(scope="module")
def coarse() -> GarmentMesh:
    return make_coat(CoatParameters(), 0.04)


@pytest.fixture(scope="module")
def matrix(fine: GarmentMesh, coarse: GarmentMesh) -> sp.csr_array:
    return barycentric_transfer(fine, coarse)


def test_weights_are_a_convex_combination(
    matrix: sp.csr_array, fine: GarmentMesh, coarse: GarmentMesh
) -> None:
    assert matrix.shape == (len(coarse.rest_position), len(fine.rest_position))
    assert np.allclose(matrix.sum(axis=1), 1.0, atol=1e-12)
    assert matrix.data.min() >= 0.0
    assert np.diff(matrix.indptr).max() <= 3


def test_rest_maps_near_to_rest(
    matrix: sp.csr_array, fine: GarmentMesh, coarse: GarmentMesh
) -> None:
    away = np.linalg.norm(matrix @ fine.rest_position - coarse.rest_position, axis=1)
    assert away.max() < 0.01


def test_rigid_motion_commutes_with_transfer(matrix: sp.csr_array, fine: GarmentMesh) -> None:
    rotation = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    shift = np.array([0.3, -1.0, 2.0])
    moved = matrix @ (fine.rest_position @ rotation.T + shift)
    assert np.allclose(moved, (matrix @ fine.rest_position) @ rotation.T + shift)


def test_mesh_maps_to_itself_as_identity(coarse: GarmentMesh) -> None:
    matrix = barycentric_transfer(coarse, coarse)
    assert np.allclose(matrix.toarray(), np.eye(len(coarse.rest_position)), atol=1e-9)


def test_loop_nodes_stay_on_their_loop(
    matrix: sp.csr_array, fine: GarmentMesh, coarse: GarmentMesh
) -> None:
    for name, loop in coarse.loops.items():
        for row in loop:
            nodes = matrix.indices[matrix.indptr[row] : matrix.indptr[row + 1]]
            assert set(nodes) <= set(fine.loops[name].tolist())


def test_closest_point_beats_every_node(
    matrix: sp.csr_array, fine: GarmentMesh, coarse: GarmentMesh
) -> None:
    rng = np.random.default_rng(1)
    on_loop = np.concatenate(list(coarse.loops.values()))
    rows = rng.choice(np.setdiff1d(np.arange(matrix.shape[0]), on_loop), 50, replace=False)
    mapped = matrix @ fine.rest_position
    for row in rows:
        best = np.linalg.norm(fine.rest_position - coarse.rest_position[row], axis=1).min()
        assert np.linalg.norm(mapped[row] - coarse.rest_position[row]) <= best + 1e-12
