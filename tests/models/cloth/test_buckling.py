"""Compression that gives way: its force, its stiffness, and what it bears."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.buckling import Buckling, buckled_product, buckling_strain
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.filtered_stiffness import filtered_product, prepare_filtered
from drake_dress.models.cloth.forces import internal_force
from drake_dress.models.cloth.material import Material
from tests.models.cloth.sheets import sheet_elements

MATERIAL = Material(stretch_stiffness=1500.0, bending_stiffness=1.5e-3)


def product(e: Elements, block: FloatArray, z: FloatArray) -> FloatArray:
    out = np.zeros_like(z)
    buckled_product(z, e.triangle_lanes, e.gradient_lanes, block, 1.0, out)
    return out


def test_load_is_eulers_for_the_shortest_wave_of_the_mesh() -> None:
    _, e = sheet_elements(5, 5, 0.02)
    load = MATERIAL.stretch_stiffness * buckling_strain(e, MATERIAL, 3.0)
    assert load == pytest.approx(1.5e-3 * (2.0 * np.pi / 0.06) ** 2)
    _, finer = sheet_elements(5, 5, 0.01)
    assert buckling_strain(finer, MATERIAL, 3.0)[0] == pytest.approx(4.0 * load[0] / 1500.0)


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.floats(1.0, 1.2), st.floats(1.0, 1.2))
def test_what_is_pulled_is_as_without(seed: int, along: float, across: float) -> None:
    x, e = sheet_elements(6, 7, 0.02)
    rng = np.random.default_rng(seed)
    pulled = x * np.array([1.01 * along, 1.01 * across, 1.0])
    pulled += 1e-5 * rng.normal(size=x.shape)
    buckling = Buckling(e, MATERIAL, 3.0)
    plain = internal_force(e, 1500.0, 0.0, pulled)
    np.testing.assert_allclose(buckling.force(e, pulled), plain, atol=1e-9 * np.abs(plain).max())
    z, usual = rng.normal(size=x.shape), np.zeros_like(x)
    filtered_product(
        z, e.triangle_lanes, e.gradient_lanes, prepare_filtered(e, 1500.0, pulled), 1.0, usual
    )
    found = product(e, buckling.prepare(e, pulled), z)
    np.testing.assert_allclose(found, usual, atol=1e-9 * np.abs(usual).max())


@pytest.mark.parametrize("strain", [0.005, 0.03, 0.2])
def test_pushed_strip_bears_no_more_than_its_load(strain: float) -> None:
    x, e = sheet_elements(6, 11, 0.02)
    pushed = x * np.array([1.0, 1.0 - strain, 1.0])
    end = np.isclose(x[:, 1], 0.0)
    width = 5 * 0.02
    bearing = -Buckling(e, MATERIAL, 3.0).force(e, pushed)[end, 1].sum() / width
    limit = float(buckling_strain(e, MATERIAL, 3.0)[0])
    beyond = max(strain - limit, 0.0)
    assert bearing == pytest.approx(1500.0 * (min(strain, limit) + 0.02 * beyond), rel=1e-9)


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_stiffness_is_the_derivative_of_force_in_the_plane(seed: int) -> None:
    """Where every triangle is pulled one way and pushed the other, far past its load."""
    x, e = sheet_elements(5, 6, 0.02)
    rng = np.random.default_rng(seed)
    there = x * np.array([0.9, 1.04, 1.0]) + 1e-4 * rng.normal(size=x.shape)
    there[:, 2] = 0.0
    z = rng.normal(size=x.shape)
    z[:, 2] = 0.0
    buckling, step = Buckling(e, MATERIAL, 3.0), 1e-7
    ahead, behind = (buckling.force(e, there + s * z) for s in (step, -step))
    difference = -(ahead - behind) / (2.0 * step)
    found = product(e, buckling.prepare(e, there), z)
    assert np.linalg.norm(found - difference) < 1e-5 * np.linalg.norm(difference)


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_stiffness_is_symmetric_and_never_gains_energy(seed: int) -> None:
    x, e = sheet_elements(6, 7, 0.02)
    rng = np.random.default_rng(seed)
    crushed = x * rng.uniform(0.4, 1.3, size=3) + 0.004 * rng.normal(size=x.shape)
    block = Buckling(e, MATERIAL, 3.0).prepare(e, crushed)
    y, z = rng.normal(size=(2, *x.shape))
    of_y, of_z = product(e, block, y), product(e, block, z)
    assert np.sum(z * of_z) >= -1e-9
    assert np.sum(y * of_z) == pytest.approx(np.sum(z * of_y), rel=1e-9, abs=1e-9)


def test_force_does_not_turn_or_move_the_cloth() -> None:
    x, e = sheet_elements(6, 7, 0.02)
    rng = np.random.default_rng(4)
    crushed = x * np.array([0.8, 1.1, 1.0]) + 0.004 * rng.normal(size=x.shape)
    force = Buckling(e, MATERIAL, 3.0).force(e, crushed)
    size = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * size
    assert np.abs(np.cross(crushed, force).sum(axis=0)).max() < 1e-12 * size
