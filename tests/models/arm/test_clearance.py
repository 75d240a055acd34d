"""Distances of capsules and round cones against sampling, their rates against differences."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arm.clearance import (
    ArmShape,
    Capsules,
    clearance,
    find_gap_rates,
    nearest,
)
from drake_dress.models.arm.panda import LIMITS, panda
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles


def segments(seed: int) -> tuple[np.ndarray, ...]:
    """Returns ends of 12 pairs of segments: some parallel, some points, some crossing."""
    rng = np.random.default_rng(seed)
    a, b, c, d = rng.normal(0.0, 0.3, (4, 12, 3))
    d[0] = c[0] + 0.7 * (b[0] - a[0])
    d[1] = c[1] - 1.7 * (b[1] - a[1])
    b[2] = a[2]
    d[3] = c[3]
    b[4], d[4] = a[4], c[4]
    c[5], d[5] = 0.5 * (a[5] + b[5]) + [0.1, 0.2, 0.0], 0.5 * (a[5] + b[5]) - [0.1, 0.2, 0.0]
    return a, b, c, d


@given(seed=st.integers(0, 2**31))
@settings(max_examples=30)
def test_no_pair_of_points_is_nearer(seed: int) -> None:
    a, b, c, d = segments(seed)
    s, t = np.array([nearest(*ends) for ends in zip(a, b, c, d, strict=True)]).T[:, :, None]
    here, there = a + s * (b - a), c + t * (d - c)
    found = np.linalg.norm(here - there, axis=1)
    t = np.linspace(0.0, 1.0, 61)[:, None, None]
    on_first, on_second = a + t * (b - a), c + t * (d - c)
    sampled = np.linalg.norm(on_first[:, None] - on_second[None], axis=3).min(axis=(0, 1))
    assert (found <= sampled + 1e-9).all()
    # and they are on the segments
    for p, e, f in ((here, a, b), (there, c, d)):
        ways = np.linalg.norm(p - e, axis=1) + np.linalg.norm(f - p, axis=1)
        np.testing.assert_allclose(ways, np.linalg.norm(f - e, axis=1), atol=1e-9)


def cones(seed: int) -> tuple[Capsules, Capsules]:
    """Returns 12 pairs of round cones, from capsules to single spheres."""
    a, b, c, d = segments(seed)
    rng = np.random.default_rng(seed)
    first, second = rng.uniform(0.02, 0.1, (2, 12, 2))
    first[6] = 0.05
    second[7] = 0.05
    first[8, 1] = first[8, 0] + 2.0 * np.linalg.norm(b[8] - a[8])
    return Capsules(a, b, first), Capsules(c, d, second)


@given(seed=st.integers(0, 2**31))
@settings(max_examples=60)
def test_no_pair_of_spheres_of_round_cones_is_nearer(seed: int) -> None:
    one, other = cones(seed)
    near = clearance(one, other, np.repeat(np.arange(12)[:, None], 2, axis=1))
    t = np.linspace(0.0, 1.0, 61)[:, None, None]
    x, y = (c.first + t * (c.second - c.first) for c in (one, other))
    r, s = (c.radius[:, 0] + t[..., 0] * np.diff(c.radius)[:, 0] for c in (one, other))
    apart = np.linalg.norm(x[:, None] - y[None], axis=3) - r[:, None] - s[None]
    sampled = apart.min(axis=(0, 1))
    assert (near.distance <= sampled + 1e-9).all()
    lengths = np.linalg.norm([one.second - one.first, other.second - other.first], axis=2)
    growths = np.abs([np.diff(one.radius)[:, 0], np.diff(other.radius)[:, 0]])
    assert (near.distance >= sampled - (lengths + growths).sum(axis=0) / 60.0 - 1e-9).all()
    back = clearance(other, one, near.pair)
    np.testing.assert_allclose(back.distance, near.distance, atol=1e-9)


@given(seed=st.integers(0, 2**31))
@settings(max_examples=30)
def test_way_apart_leads_from_surface_to_surface(seed: int) -> None:
    one, other = cones(seed)
    near = clearance(one, other, np.repeat(np.arange(12)[:, None], 2, axis=1))
    for k in np.flatnonzero(near.distance > 0.0):
        first, second = (
            Obstacles.resting(c.first[k : k + 1], c.second[k : k + 1], c.radius[k : k + 1])
            for c in (one, other)
        )
        from_first = find_proximity(near.there[k : k + 1], first, 0.0).gap[0]
        from_second = find_proximity(near.here[k : k + 1], second, 0.0).gap[0]
        there = near.there[k] + (from_first - near.distance[k]) * near.away[k]
        here = near.here[k] - (from_second - near.distance[k]) * near.away[k]
        np.testing.assert_allclose(
            find_proximity(there[None], first, 0.0).gap, near.distance[k], atol=1e-8
        )
        np.testing.assert_allclose(
            find_proximity(here[None], second, 0.0).gap, near.distance[k], atol=1e-8
        )
        np.testing.assert_allclose(
            find_proximity(np.stack([here, there]), second, 0.0).gap[1], 0.0, atol=1e-8
        )


def test_capsules_are_apart_by_what_their_radii_leave() -> None:
    one = Capsules(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), np.array([0.1]))
    other = Capsules(np.array([[0.5, 0.0, 0.4]]), np.array([[0.5, 0.3, 0.4]]), np.array([0.15]))
    near = clearance(one, other, np.array([[0, 0]]))
    np.testing.assert_allclose(near.distance, 0.25)
    np.testing.assert_allclose(near.away, [[-1.0, 0.0, 0.0]])


def test_axes_that_cross_have_a_way_apart() -> None:
    one = Capsules(np.array([[-1.0, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0]]), np.array([0.1]))
    other = Capsules(np.array([[0.0, -1.0, 0.0]]), np.array([[0.0, 1.0, 0.0]]), np.array([0.1]))
    near = clearance(one, other, np.array([[0, 0]]))
    np.testing.assert_allclose(near.distance, -0.2)
    np.testing.assert_allclose(np.abs(near.away), [[0.0, 0.0, 1.0]], atol=1e-9)


@given(seed=st.integers(0, 2**31))
@settings(max_examples=20)
def test_rates_are_what_finite_differences_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arm = panda(np.eye(4))
    link = np.arange(8)
    first, second = rng.normal(0.0, 0.1, (2, 8, 3))
    shape = ArmShape(link, Capsules(first, second, rng.uniform(0.02, 0.06, 8)))
    first, second = rng.normal(0.0, 0.5, (2, 3, 3))
    radii = rng.uniform(0.05, 0.1, (3, 2))
    radii[0] = radii[0, 0]
    person = Capsules(first, second, radii)
    pairs = np.stack(np.meshgrid(link, np.arange(3), indexing="ij"), axis=-1).reshape(-1, 2)
    q, e = rng.uniform(LIMITS.lower, LIMITS.upper), 1e-6
    way = rng.normal(size=7)

    def distance(s: float) -> np.ndarray:
        return clearance(shape.placed(arm.links(q + s * way)), person, pairs).distance

    links = arm.links(q)
    near = clearance(shape.placed(links), person, pairs)
    gradient = np.empty((len(pairs), 7))
    for m, (k, _) in enumerate(pairs):
        find_gap_rates(links, near.here[m], link[k], near.away[m], 1.0, gradient[m])
    rates = gradient @ way
    steady = np.abs(distance(e) - 2.0 * near.distance + distance(-e)) < 1e-9
    np.testing.assert_allclose(
        rates[steady], ((distance(e) - distance(-e)) / (2 * e))[steady], atol=1e-5
    )
    assert steady.mean() > 0.8
