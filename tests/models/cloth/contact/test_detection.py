from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.cloth.contact.detection import find_proximity, out_of_reach
from drake_dress.models.cloth.contact.distance import distance_to, nearest_obstacle
from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles


@given(st.integers(0, 10_000), st.floats(0.0, 0.5))
@settings(max_examples=60)
def test_what_is_out_of_reach_is_as_far_as_asked(seed: int, distance: float) -> None:
    rng = np.random.default_rng(seed)
    x = rng.uniform(-0.3, 0.3, (20, 3)) + rng.uniform(-1.5, 1.5, 3)
    ends = rng.uniform(-0.5, 0.5, (2, 3, 3))
    bodies = Obstacles.resting(ends[0], ends[1], rng.uniform(0.02, 0.2, (3, 2)))
    plane = HalfSpaces.resting(rng.uniform(-2.0, 2.0, 3), rng.standard_normal(3))
    bodies = replace(bodies, half_spaces=plane)
    gap = find_proximity(x, bodies, 0.0).gap
    assert gap.min() > distance or not out_of_reach(x, bodies, distance)
    # far above the plane nothing is near
    far = x + 20.0 * plane.normal
    assert out_of_reach(far, bodies, distance)
    assert out_of_reach(x, Obstacles.none(), distance)


@given(st.integers(0, 10_000), st.integers(1, 9))
def test_nearest_round_cone_is_the_nearest_of_all(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, count, 3))
    radius = rng.uniform(0.01, 1.0, (count, 2))
    radius[::3, 1] = radius[::3, 0]
    x = rng.normal(size=(40, 3)).cumsum(axis=0) * 0.3
    shapes = Obstacles.resting(a, b, radius).packed
    gap, owner = np.empty(40), np.empty(40, dtype=np.int32)
    nearest_obstacle(x, shapes, gap, owner)
    alone = np.empty((count, 40))
    for k in range(count):
        distance_to(x, shapes, np.full(40, k, dtype=np.int32), alone[k])
    np.testing.assert_array_equal(gap, alone.min(axis=0))
    np.testing.assert_array_equal(owner, alone.argmin(axis=0))


@given(st.integers(0, 10_000), st.integers(1, 9))
def test_nearest_capsule_is_the_nearest_of_all(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, count, 3))
    b[::3] = a[::3]
    radius = rng.uniform(0.01, 1.0, count)
    x = rng.normal(size=(40, 3)).cumsum(axis=0) * 0.3
    gap, owner = np.empty(40), np.empty(40, dtype=np.int32)
    nearest_obstacle(x, Obstacles.resting(a, b, radius).packed, gap, owner)
    way = b - a
    along = np.einsum("ikc,kc->ik", x[:, None] - a, way)
    t = np.clip(along / np.maximum((way**2).sum(axis=1), 1e-300), 0.0, 1.0)
    all_gaps = np.linalg.norm(x[:, None] - a - t[..., None] * way, axis=2) - radius
    np.testing.assert_array_equal(owner, all_gaps.argmin(axis=1))
    np.testing.assert_allclose(gap, all_gaps.min(axis=1), atol=1e-12)
