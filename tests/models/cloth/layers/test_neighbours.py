"""Laws of the search for pairs."""

from collections.abc import Collection

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.layers.closest import closest, offset, separation
from drake_dress.models.cloth.layers.motion import relative_motion
from drake_dress.models.cloth.layers.neighbours import PairFinder
from drake_dress.models.cloth.layers.topology import make_topology
from tests.models.cloth.layers.scenes import all_pairs, crumpled

# About that of the crumpled sheets, m.
EDGE = 0.02
CRUMPLED = crumpled(3)


def _sampled_distance(kind: int, corner: FloatArray) -> float:
    """The least distance over a grid of points of both parts, an upper bound of the true one."""
    u, v = (k.ravel() for k in np.meshgrid(np.linspace(0, 1, 60), np.linspace(0, 1, 60)))
    if kind == 0:
        inside = u + v <= 1.0
        u, v = u[inside, None], v[inside, None]
        points = (1 - u - v) * corner[1] + u * corner[2] + v * corner[3]
        return float(np.linalg.norm(points - corner[0], axis=1).min())
    first = (1 - u[:, None]) * corner[0] + u[:, None] * corner[1]
    second = (1 - v[:, None]) * corner[2] + v[:, None] * corner[3]
    return float(np.linalg.norm(first - second, axis=1).min())


@pytest.mark.parametrize("kind", [0, 1])
def test_no_points_are_closer_than_the_closest(kind: int) -> None:
    rng = np.random.default_rng(kind)
    weights = np.empty(4)
    for _ in range(200):
        corner = rng.normal(size=(4, 3))
        closest(corner, kind, np.arange(4), weights)
        distance = float(np.linalg.norm(offset(corner, np.arange(4), weights)))
        sampled = _sampled_distance(kind, corner)
        assert distance <= sampled + 1e-12
        assert distance >= sampled - 0.12
        assert weights.sum() == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("kind", [0, 1])
def test_parts_that_have_collapsed_have_closest_points(kind: int) -> None:
    rng = np.random.default_rng(kind)
    weights = np.empty(4)
    for k in range(100):
        corner = rng.normal(size=(4, 3))
        corner[3] = corner[2]
        if k % 2:
            corner[3] = 0.3 * corner[1] + 0.7 * corner[2]
        if k % 5 == 0:
            corner[1] = corner[2] = corner[3]
        closest(corner, kind, np.arange(4), weights)
        distance = float(np.linalg.norm(offset(corner, np.arange(4), weights)))
        sampled = _sampled_distance(kind, corner)
        assert sampled - 0.12 <= distance <= sampled + 1e-6


@pytest.mark.parametrize("kind", [0, 1])
def test_plane_across_the_closest_points_separates(kind: int) -> None:
    rng = np.random.default_rng(kind)
    weights = np.empty(4)
    for k in range(500):
        corner = rng.normal(size=(4, 3))
        if k % 3 == 0:
            # parallel edges, triangles that are nearly lines
            corner[3] = corner[2] + (corner[1] - corner[0]) * (1.0 + 1e-9 * rng.normal())
        closest(corner, kind, np.arange(4), weights)
        vector = np.array(offset(corner, np.arange(4), weights))
        distance = float(np.linalg.norm(vector))
        gap, _, _ = separation(corner, kind, np.arange(4), *(vector / distance))
        assert gap == pytest.approx(distance, abs=1e-7)


@pytest.mark.parametrize("rings", [1, 2])
def test_every_pair_that_may_come_near_is_found_once(rings: int) -> None:
    near = 6e-3
    for seed in (rings,):
        x, e = crumpled(seed)
        rng = np.random.default_rng(seed)
        dx = rng.normal(scale=1.5e-3, size=x.shape) + np.cross([0.1, 0.2, -0.3], x) + 0.4
        topology = make_topology(e, rings)
        motion = relative_motion(topology, x, dx)
        pairs = PairFinder(topology, EDGE).find(x, motion, near)
        found = [
            (int(k), _key(int(k), n)) for k, n in zip(pairs.kind, pairs.node.tolist(), strict=True)
        ]
        assert len(set(found)) == len(found)
        weights = np.empty(4)
        expected = set()
        for kind, nodes in all_pairs(e, rings):
            index = np.array(nodes)
            closest(x, kind, index, weights)
            distance = np.linalg.norm(offset(x, index, weights))
            first = index[:1] if kind == 0 else index[:2]
            second = index[1:] if kind == 0 else index[2:]
            apart = np.linalg.norm(motion.rest[first][:, None] - motion.rest[second][None], axis=2)
            if distance <= near + apart.max() - 1e-12:
                expected.add((kind, _key(kind, list(nodes))))
        assert len(expected) > 300
        assert set(found) == expected


@given(
    st.integers(0, 2**32 - 1),
    st.floats(1e-5, 3e-3),
    st.floats(0.0, 0.3),
)
@settings(max_examples=20)
def test_what_was_found_before_makes_no_difference(seed: int, size: float, turn: float) -> None:
    x, e = CRUMPLED
    topology = make_topology(e, 1)
    keeps = PairFinder(topology, EDGE)
    rng = np.random.default_rng(seed)
    drift = rng.normal(size=x.shape)
    for _ in range(8):
        dx = size * (drift + 0.3 * rng.normal(size=x.shape))
        dx += np.cross(turn * rng.normal(size=3), x) + rng.normal(size=3)
        motion = relative_motion(topology, x, dx)
        near = rng.uniform(4e-3, 6e-3)
        kept, fresh = (f.find(x, motion, near) for f in (keeps, PairFinder(topology, EDGE)))
        for name, values in vars(fresh).items():
            np.testing.assert_array_equal(getattr(kept, name), values)
        x = x + dx


def _key(kind: int, nodes: list[int]) -> Collection[frozenset[int]]:
    if kind == 0:
        return frozenset(nodes[:1]), frozenset(nodes[1:])
    return frozenset((frozenset(nodes[:2]), frozenset(nodes[2:])))


def test_rigid_motion_leaves_no_relative_motion() -> None:
    x, e = crumpled(0)
    motion = relative_motion(
        make_topology(e, 1), x, np.cross([0.5, -0.2, 0.4], x) + [1.0, 2.0, 3.0]
    )
    assert motion.reach.max() < 1e-9
