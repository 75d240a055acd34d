import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.files import RawMesh
from drake_dress.models.garment.manifold import check_manifold
from drake_dress.models.garment.merge import duplicates_merged, seams_sewn

JACKET = make_coat(COATS["jacket"], 0.06)
X = JACKET.rest_position
FACES = JACKET.faces.astype(np.int64)


def in_panels(panel: IndexArray, gap: float, seed: int) -> tuple[RawMesh, IndexArray]:
    """The jacket cut into panels, each with nodes of its own, moved by up to half the gap."""
    rng = np.random.default_rng(seed)
    faces, origin = [], []
    position: list[FloatArray] = []
    for k in np.unique(panel):
        own, local = np.unique(FACES[panel == k], return_inverse=True)
        faces.append(local.reshape(-1, 3) + sum(map(len, position)))
        away = rng.standard_normal((len(own), 3))
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        position.append(X[own] + 0.5 * gap * rng.uniform(0, 1, (len(own), 1)) * away)
        origin.append(own)
    mesh = RawMesh.of("coat", np.concatenate(position), np.concatenate(faces))
    return mesh, np.concatenate(origin)


def quadrants() -> IndexArray:
    middle = X[FACES].mean(axis=1)
    return (middle[:, 1] > 0.01) + 2 * (middle[:, 0] > 0.0)


@settings(max_examples=25)
@given(st.floats(1e-7, 5e-3), st.integers(0, 2**32 - 1))
def test_seams_within_the_distance_are_sewn_and_nothing_else(gap: float, seed: int) -> None:
    mesh, origin = in_panels(quadrants(), gap, seed)
    sewn = seams_sewn(mesh, gap)
    # nodes are one if and only if they were before the jacket was cut
    for a in np.unique(origin):
        assert len(np.unique(sewn.became[origin == a])) == 1
    assert len(sewn.position) == len(X)
    assert len(sewn.faces) == len(FACES)
    check_manifold(sewn.faces, len(sewn.position))
    assert len(boundary_loops(sewn.faces)) == len(boundary_loops(FACES))
    moved = np.linalg.norm(sewn.position[sewn.became] - mesh.position, axis=1)
    assert moved.max() <= 2 * gap


@settings(max_examples=25)
@given(st.floats(5e-3, 3e-2), st.integers(0, 2**32 - 1))
def test_what_is_sewn_lets_nothing_more_be_sewn(gap: float, seed: int) -> None:
    mesh, origin = in_panels(quadrants(), gap, seed)
    sewn = seams_sewn(mesh, gap)
    assert len(sewn.position) < len(mesh.position)
    assert len(seams_sewn(sewn, gap).position) == len(sewn.position)
    assert sewn.became.shape == origin.shape
    assert sewn.became.max() == len(sewn.position) - 1


@settings(max_examples=25)
@given(st.floats(0.0, 0.02))
def test_a_sound_mesh_stays_as_it_is(distance: float) -> None:
    mesh = RawMesh.of("coat", X, FACES)
    sewn = seams_sewn(duplicates_merged(mesh), distance)
    assert np.array_equal(sewn.position, X)
    assert np.array_equal(sewn.faces, FACES)
    assert np.array_equal(sewn.became, np.arange(len(X)))


def test_a_narrow_ribbon_is_not_sewn_to_itself() -> None:
    along = np.arange(20.0) * 0.02
    x = np.concatenate([np.stack([along, 0 * along + y, 0 * along], axis=1) for y in (0, 0.004)])
    quads = [(i, i + 1, i + 21, i + 20) for i in range(19)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    mesh = RawMesh.of("ribbon", x, faces)
    assert np.array_equal(seams_sewn(mesh, 0.008).faces, faces)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_equal_nodes_are_merged_in_any_order(seed: int) -> None:
    soup = X[FACES].reshape(-1, 3)
    order = np.random.default_rng(seed).permutation(len(soup))
    new = np.empty(len(order), dtype=np.int64)
    new[order] = np.arange(len(order))
    mesh = duplicates_merged(RawMesh.of("coat", soup[order], new.reshape(-1, 3)))
    assert len(mesh.position) == len(X)
    assert np.array_equal(mesh.position[mesh.faces], X[FACES])
    assert np.array_equal(mesh.position[mesh.became], soup[order])
