"""Round cones: distances against supporting planes, normals, and capsules as a special case."""

import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.distance import normal_derivative
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.round_cone import both_radii, nearest_share, solid, surface

SEEDS = st.integers(0, 2**31)


def drawn(seed: int, count: int = 40) -> tuple[Obstacles, FloatArray]:
    """Returns a round cone, slender to almost one sphere, and points in and about it."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(0.0, 0.3, (2, 3))
    length = np.linalg.norm(b - a)
    radii = rng.uniform(0.02, 0.3) + np.array([0.0, rng.uniform(0.0, 0.97) * length])
    limb = Obstacles.resting(a[None], b[None], rng.permutation(radii)[None])
    share = rng.uniform(-0.3, 1.3, (count, 1))
    away = rng.normal(size=(count, 3)) * rng.uniform(0.0, 0.5, (count, 1))
    return limb, a + share * (b - a) + away


def by_planes(p: FloatArray, limb: Obstacles) -> float:
    """Returns the greatest distance of `p` from a supporting plane: the signed distance.

    The normals of the planes that matter lie in the plane of the axis and the point.
    """
    a, b, (r_a, r_b) = limb.a[0], limb.b[0], limb.radius[0]
    along = (b - a) / np.linalg.norm(b - a)
    out = (p - a) - ((p - a) @ along) * along
    out /= np.linalg.norm(out)
    best, width = 0.5 * np.pi, 0.5 * np.pi
    for _ in range(4):
        angle = best + np.linspace(-width, width, 1001)
        normal = np.cos(angle)[:, None] * along + np.sin(angle)[:, None] * out
        distance = normal @ p - np.maximum(normal @ a + r_a, normal @ b + r_b)
        best, width = angle[distance.argmax()], 0.005 * width
    return float(distance.max())


@given(SEEDS)
@settings(max_examples=50)
def test_distance_is_the_greatest_from_a_supporting_plane(seed: int) -> None:
    limb, x = drawn(seed, 12)
    gap = find_proximity(x, limb, 0.0).gap
    expected = [by_planes(p, limb) for p in x]
    np.testing.assert_allclose(gap, expected, atol=2e-8)


@given(SEEDS)
@settings(max_examples=50)
def test_no_sphere_of_the_cone_is_nearer(seed: int) -> None:
    limb, x = drawn(seed)
    t = np.linspace(0.0, 1.0, 501)
    center = limb.a + t[:, None] * (limb.b - limb.a)
    radius = limb.radius[0, 0] + t * (limb.radius[0, 1] - limb.radius[0, 0])
    sampled = (np.linalg.norm(x[:, None] - center, axis=2) - radius).min(axis=1)
    gap = find_proximity(x, limb, 0.0).gap
    assert (gap <= sampled + 1e-12).all()
    # the nearest sphere is at most half a spacing along the axis from a sampled one
    assert (gap >= sampled - 2e-3 * np.linalg.norm(limb.b - limb.a)).all()


@given(SEEDS)
@settings(max_examples=50)
def test_normal_is_the_unit_gradient_and_leads_to_the_surface(seed: int) -> None:
    limb, x = drawn(seed)
    near = find_proximity(x, limb, 0.0)
    np.testing.assert_allclose(np.linalg.norm(near.normal, axis=1), 1.0, rtol=1e-12)
    on_surface = x - near.gap[:, None] * near.normal
    # points near the axis have their nearest point on a whole circle
    far = _radius_of_curvature(limb, near.gap, x) > 1e-3
    back = find_proximity(on_surface[far], limb, 0.0)
    np.testing.assert_allclose(back.gap, 0.0, atol=1e-9)
    np.testing.assert_allclose(back.normal, near.normal[far], atol=1e-6)


def _radius_of_curvature(limb: Obstacles, gap: FloatArray, x: FloatArray) -> FloatArray:
    growth = limb.radius[0, 1] - limb.radius[0, 0]
    t = np.array([nearest_share(p, limb.a[0], limb.b[0], growth) for p in x])
    return np.asarray(gap + limb.radius[0, 0] + t * growth)


@given(SEEDS)
@settings(max_examples=60)
def test_derivative_of_the_normal_matches_finite_differences(seed: int) -> None:
    limb, x = drawn(seed)
    rng = np.random.default_rng(seed + 1)
    near = find_proximity(x, limb, 0.0)
    bar, d, step = rng.normal(size=x.shape), rng.normal(size=x.shape), 1e-6
    out = np.empty_like(x)
    normal_derivative(x, limb.packed, near.owner, near.normal, bar, out)
    high, low = (find_proximity(x + s * step * d, limb, 0.0).normal for s in (1.0, -1.0))
    bent = np.linalg.norm(high - 2.0 * near.normal + low, axis=1)
    smooth = (bent < 1e-9) & (_radius_of_curvature(limb, near.gap, x) > 0.02)
    assume(smooth.sum() > 5)
    rate = np.einsum("ij,ij->i", bar, (high - low) / (2.0 * step))
    exact = np.einsum("ij,ij->i", out, d)
    np.testing.assert_allclose(exact[smooth], rate[smooth], rtol=1e-4, atol=1e-4)


@given(SEEDS)
@settings(max_examples=30)
def test_equal_radii_are_a_capsule_bit_for_bit(seed: int) -> None:
    """The capsule is computed as before there were round cones, in the same order."""
    limb, x = drawn(seed)
    radius = limb.radius[0, 0]
    gap = find_proximity(x, Obstacles.resting(limb.a, limb.b, np.array([radius])), 0.0).gap
    same = find_proximity(x, Obstacles.resting(limb.a, limb.b, np.full((1, 2), radius)), 0.0).gap
    np.testing.assert_array_equal(gap, same)
    a, d = [float(v) for v in limb.a[0]], [float(v) for v in limb.b[0] - limb.a[0]]
    length2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    for p, found in zip(x, gap, strict=True):
        q = [float(v) - w for v, w in zip(p, a, strict=True)]
        t = min(1.0, max(0.0, (q[0] * d[0] + q[1] * d[1] + q[2] * d[2]) / length2))
        r = [v - t * w for v, w in zip(q, d, strict=True)]
        assert found == np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) - radius


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("length", [0.0, 0.03, 0.06])
def test_sphere_that_holds_the_other_is_all_there_is(length: float, swap: bool) -> None:
    ends = np.array([[0.1, 0.0, 0.0], [0.1, length, 0.0]])
    radii = np.array([0.1, 0.04])
    if swap:
        ends, radii = ends[::-1], radii[::-1]
    x = np.random.default_rng(0).normal(0.0, 0.2, (50, 3))
    cone = Obstacles.resting(ends[:1], ends[1:], radii[None])
    sphere = Obstacles.resting(
        np.array([[0.1, 0.0, 0.0]]), np.array([[0.1, 0, 0]]), np.array([0.1])
    )
    found, expected = (find_proximity(x, o, 0.0) for o in (cone, sphere))
    np.testing.assert_array_equal(found.gap, expected.gap)
    np.testing.assert_array_equal(found.normal, expected.normal)


@given(SEEDS)
@settings(max_examples=30)
def test_distance_changes_by_no_more_than_radii_do(seed: int) -> None:
    """Also where a cone becomes one sphere, nothing jumps."""
    limb, x = drawn(seed)
    rng = np.random.default_rng(seed)
    length = np.linalg.norm(limb.b - limb.a)
    radii = np.array([[0.05, 0.05 + length * (1.0 + rng.uniform(-1e-6, 1e-6))]])
    change = rng.uniform(-1e-6, 1e-6, (1, 2))
    before, after = (
        find_proximity(x, Obstacles.resting(limb.a, limb.b, r), 0.0).gap
        for r in (radii, radii + change)
    )
    # a cone within 1e-9 of one sphere is replaced by it
    assert np.abs(after - before).max() <= np.abs(change).max() + 1e-8 * length


@given(SEEDS)
@settings(max_examples=20)
def test_distance_does_not_depend_on_the_frame_or_the_order_of_ends(seed: int) -> None:
    limb, x = drawn(seed)
    gap = find_proximity(x, limb, 0.0).gap
    turned = Obstacles.resting(limb.b, limb.a, limb.radius[:, ::-1])
    np.testing.assert_allclose(find_proximity(x, turned, 0.0).gap, gap, atol=1e-12)
    rng = np.random.default_rng(seed)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    shift = rng.normal(size=3)
    moved = Obstacles.resting(limb.a @ q.T + shift, limb.b @ q.T + shift, limb.radius)
    np.testing.assert_allclose(find_proximity(x @ q.T + shift, moved, 0.0).gap, gap, atol=1e-12)


@given(st.floats(0.05, 0.5), st.floats(0.02, 0.2), st.floats(-0.9, 0.9))
@settings(max_examples=30)
def test_surface_lies_on_the_round_cone_and_is_closed(length: float, r: float, lean: float) -> None:
    radii = (r + max(0.0, -lean * length), r + max(0.0, lean * length))
    vertices, normals, faces = surface(length, radii)
    half = np.array([[0.0, 0.0, 0.5 * length]])
    near = find_proximity(vertices, Obstacles.resting(-half, half, np.array([radii])), 0.0)
    np.testing.assert_allclose(near.gap, 0.0, atol=1e-12)
    np.testing.assert_allclose(near.normal, normals, atol=1e-6)
    corner = vertices[faces]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    outward = np.einsum("ij,ij->i", across, normals[faces].mean(axis=1))
    assert (outward > -1e-15).all()
    # the divergence theorem: the volume between that of the larger sphere and that of its capsule
    volume = np.einsum("ij,ij->i", corner[:, 0], across).sum() / 6.0
    biggest = max(radii)
    assert 0.97 * 4.0 / 3.0 * np.pi * biggest**3 < volume
    assert volume < np.pi * biggest**2 * (length + 4.0 / 3.0 * biggest)


def test_one_radius_counts_for_both_ends() -> None:
    np.testing.assert_array_equal(both_radii(np.array([0.1, 0.2])), [[0.1, 0.1], [0.2, 0.2]])
    np.testing.assert_array_equal(both_radii(np.array([[0.1, 0.2]])), [[0.1, 0.2]])


@given(SEEDS)
@settings(max_examples=20)
def test_solid_has_the_mass_properties_of_its_surface(seed: int) -> None:
    rng = np.random.default_rng(seed)
    length, thick = rng.uniform(0.2, 0.4), rng.uniform(0.02, 0.1)
    radii = tuple(rng.permutation([thick, thick + rng.uniform(0.0, 0.8) * length]).tolist())
    found = solid(length, (radii[0], radii[1]))
    vertices, _, faces = surface(length, (radii[0], radii[1]), rings=60, sectors=160)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    np.testing.assert_allclose(found.volume, mesh.volume, rtol=2e-3)
    np.testing.assert_allclose(found.center - 0.5 * length, mesh.center_mass[2], atol=1e-4)
    inertia = mesh.moment_inertia / mesh.mass
    np.testing.assert_allclose(found.about_axis, inertia[2, 2], rtol=4e-3)
    np.testing.assert_allclose(found.across, inertia[0, 0], rtol=4e-3)


def test_solid_with_equal_radii_is_a_capsule() -> None:
    length, r = 0.3, 0.05
    found = solid(length, (r, r))
    assert found.volume == pytest.approx(np.pi * r**2 * (length + 4.0 / 3.0 * r))
    assert found.center == pytest.approx(0.5 * length)
