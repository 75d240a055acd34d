"""In the hollow between two bodies cloth is held off both; elsewhere nothing changes."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.corners import held_off_corners
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.distance import nearest_other
from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.state import ClothState
from tests.models.cloth.sheets import sheet_elements

MARGIN = 0.003
H = 0.004


def walls(angle: float) -> Obstacles:
    """Returns two planes that meet in the x axis, a hollow of `angle`, rad, open upwards."""
    half = 0.5 * angle
    normal = np.array([[0.0, np.cos(half), np.sin(half)], [0.0, -np.cos(half), np.sin(half)]])
    return replace(Obstacles.none(), half_spaces=HalfSpaces.resting(np.zeros((2, 3)), normal))


def limbs(angle: float) -> Obstacles:
    """Returns an upper arm and a shoulder that meet at the origin, `angle` apart, rad."""
    ways = np.array([[np.cos(0.5 * angle), s * np.sin(0.5 * angle), 0.0] for s in (1.0, -1.0)])
    return Obstacles.resting(np.zeros((2, 3)), 0.3 * ways, np.full(2, 0.045))


@given(st.floats(0.5, 2.6), st.floats(-0.03, 0.03), st.floats(-0.03, 0.03))
def test_the_way_out_of_a_hollow_is_the_shortest(angle: float, y: float, z: float) -> None:
    bodies, x = walls(angle), np.array([[0.3, y, z]])
    near = held_off_corners(find_proximity(x, bodies, MARGIN), x, bodies, MARGIN)
    if near.gap[0] >= 0.0:
        # it is out already, or as far from one wall as it is to be and nowhere near the other
        assert min(float(n @ x[0]) for n in bodies.half_spaces.normal) >= MARGIN - 1e-9
        return
    assert np.linalg.norm(near.normal[0]) == pytest.approx(1.0)
    out = x - near.gap[:, None] * near.normal
    # it leads out of both
    after = [(out @ n).item() for n in bodies.half_spaces.normal]
    assert min(after) >= MARGIN - 1e-9
    # and nothing nearer is out of both
    side = np.linspace(-0.3, 0.3, 301)
    grid = np.stack(np.meshgrid([0.3], y + side, z + side, indexing="ij"), axis=-1).reshape(-1, 3)
    outside = (grid @ bodies.half_spaces.normal.T).min(axis=1) >= MARGIN
    assert outside.any()
    nearest = np.linalg.norm(grid[outside] - x, axis=1).min()
    assert -near.gap[0] <= nearest + 1e-9


@given(st.integers(0, 10_000))
def test_the_nearest_other_body_is_the_second_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, 4, 3))
    bodies = Obstacles.resting(a, b, rng.uniform(0.01, 0.5, 4))
    plane = HalfSpaces.resting(rng.normal(size=3), rng.standard_normal(3))
    bodies = replace(bodies, half_spaces=plane)
    x = rng.normal(size=(20, 3))
    near = find_proximity(x, bodies, 0.0)
    distance, other = np.empty(20), np.empty(20, dtype=np.int32)
    nearest_other(x, bodies.packed, near.owner, distance, other)
    assert (other != near.owner).all()
    assert (distance >= near.gap).all()
    for i in range(20):
        rest = [k for k in range(4) if k != near.owner[i]]
        keep = Obstacles.resting(bodies.a[rest], bodies.b[rest], bodies.radius[rest])
        if near.owner[i] != 4:
            keep = replace(keep, half_spaces=plane)
        assert distance[i] == pytest.approx(find_proximity(x[i : i + 1], keep, 0.0).gap[0])


def test_apart_from_hollows_nothing_changes() -> None:
    rng = np.random.default_rng(0)
    bodies = limbs(1.3)
    x = rng.uniform(-0.1, 0.3, (500, 3))
    near = find_proximity(x, bodies, MARGIN)
    after = held_off_corners(near, x, bodies, MARGIN)
    changed = after.gap != near.gap
    assert changed.any()
    assert not changed.all()
    # what is outside, or deep in one body and far from the other
    distance, other = np.empty(500), np.empty(500, dtype=np.int32)
    nearest_other(x, bodies.packed, near.owner, distance, other)
    assert not changed[near.gap >= 0.0].any()
    assert not changed[distance - MARGIN > -near.gap].any()
    np.testing.assert_array_equal(after.normal[~changed], near.normal[~changed])
    assert (after.gap[changed] <= near.gap[changed] + 1e-12).all()


@pytest.mark.parametrize("angle_deg", [50.0, 74.0, 90.0])
def test_cloth_drawn_into_a_hollow_stays_outside(angle_deg: float) -> None:
    """A strip drawn by both ends into an armpit until it pulls with 10 N."""
    angle = np.deg2rad(angle_deg)
    bodies = limbs(angle)
    x, e = sheet_elements(16, 3, 0.02)
    x = x - x.mean(axis=0)
    along = x[:, 0]
    x = np.column_stack([np.full(len(x), 0.045 / np.sin(0.5 * angle) + 0.03), x[:, 1], along])
    ends = np.flatnonzero(np.abs(along) > np.abs(along).max() - 1e-6).astype(np.int32)
    m = Material(surface_density=0.3, stretch_stiffness=1500.0, bending_stiffness=1.5e-3)
    cloth = ImplicitCloth(e, m, H, ends)
    state = ClothState.at_rest(x)
    inward = np.tile([-0.1, 0.0, 0.0], (len(ends), 1))
    deepest: list[float] = []
    pull: list[FloatArray] = []
    for k in range(400):
        state, _ = cloth.step(state, bodies, inward if k < 250 else 0.0 * inward)
        deepest.append(float(find_proximity(state.x, bodies, 0.0).gap.min()))
        pull.append(state.reaction[ends].sum(axis=0))
    assert min(deepest) > -0.005
    assert min(deepest[-50:]) > -0.002
    assert np.linalg.norm(np.mean(pull[-50:], axis=0)) > 8.0
