"""Laws of rigid zones."""

import numpy as np

from drake_dress.models.cloth.layers.impact_zones import Union, make_zone


def _zone() -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(3)
    x = rng.normal(scale=0.02, size=(12, 3))
    dx = rng.normal(scale=0.01, size=(12, 3))
    mass = rng.uniform(1e-4, 3e-4, size=12)
    return x, dx, mass, np.arange(3, 11, dtype=np.int32)


def test_zone_keeps_momentum_and_angular_momentum_and_adds_no_energy() -> None:
    x, dx, mass, node = _zone()
    after = dx.copy()
    make_zone(node, x, 1.0 / mass, np.zeros((12, 3))).apply(after)
    change = mass[:, None] * (after - dx)
    np.testing.assert_allclose(change.sum(axis=0), 0.0, atol=1e-15)
    np.testing.assert_allclose(np.cross(x, change).sum(axis=0), 0.0, atol=1e-16)
    assert np.sum(mass[:, None] * after**2) < np.sum(mass[:, None] * dx**2)
    np.testing.assert_array_equal(after[:3], dx[:3])


def test_distances_in_a_zone_do_not_shrink() -> None:
    x, dx, mass, node = _zone()
    make_zone(node, x, 1.0 / mass, np.zeros((12, 3))).apply(dx)
    before = np.linalg.norm(x[node][:, None] - x[node][None], axis=2)
    after = np.linalg.norm((x + dx)[node][:, None] - (x + dx)[node][None], axis=2)
    assert np.all(after >= before - 1e-15)


def test_prescribed_nodes_lead_their_zone() -> None:
    x, dx, mass, node = _zone()
    w = 1.0 / mass
    w[[3, 4, 5, 6]] = 0.0
    dx[[3, 4, 5, 6]] = np.cross([0.1, 0.2, 0.3], x[[3, 4, 5, 6]]) + 0.05
    after = dx.copy()
    make_zone(node, x, w, np.zeros((12, 3))).apply(after)
    np.testing.assert_array_equal(after[[3, 4, 5, 6]], dx[[3, 4, 5, 6]])
    np.testing.assert_allclose(after[node], np.cross([0.1, 0.2, 0.3], x[node]) + 0.05, atol=1e-8)


def test_transpose_of_a_zone() -> None:
    x, dx, mass, node = _zone()
    rng = np.random.default_rng(0)
    w = 1.0 / mass
    w[4] = 0.0
    barred = np.zeros((12, 3))
    barred[6] = [0.6, 0.0, 0.8]
    zone = make_zone(node, x, w, barred)
    bar = rng.normal(size=(12, 3))
    forward, back = dx.copy(), bar.copy()
    zone.apply(forward)
    zone.transpose(back)
    np.testing.assert_allclose(np.sum(bar * forward), np.sum(back * dx), rtol=1e-9)


def test_links_join_sets() -> None:
    union = Union()
    union.link([5, 3])
    union.link([7, 8])
    union.link([1, 2])
    union.link([8, 3])
    assert [s.tolist() for s in union.sets()] == [[1, 2], [3, 5, 7, 8]]
