import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.filtered_stiffness import filtered_product, prepare_filtered
from drake_dress.models.cloth.forces import internal_force, stiffness_product
from tests.models.cloth.sheets import sheet, sheet_elements

STRETCH, BENDING = 120.0, 2e-3


def force(e: Elements, x: FloatArray) -> FloatArray:
    return internal_force(e, STRETCH, BENDING, x)


def stiffness(e: Elements, x: FloatArray, z: FloatArray) -> FloatArray:
    return stiffness_product(e, STRETCH, BENDING, x, z)


def curved() -> tuple[FloatArray, Elements]:
    flat, faces = sheet(7, 9, 0.03)
    radius = 0.1
    x = np.column_stack(
        [radius * np.sin(flat[:, 0] / radius), flat[:, 1], radius * np.cos(flat[:, 0] / radius)]
    )
    return x, make_elements(x, faces)


def test_no_force_at_rest() -> None:
    x, e = curved()
    assert np.abs(force(e, x)).max() < 1e-12


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_force_turns_with_the_garment(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, e = curved()
    bent = x + 0.004 * rng.normal(size=x.shape)
    turn = Rotation.random(random_state=seed).as_matrix()
    expected = force(e, bent) @ turn.T
    np.testing.assert_allclose(force(e, bent @ turn.T + 0.3), expected, atol=1e-9)


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_internal_forces_add_up_to_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, e = curved()
    bent = x + 0.004 * rng.normal(size=x.shape)
    f = force(e, bent)
    np.testing.assert_allclose(f.sum(axis=0), 0.0, atol=1e-10)
    np.testing.assert_allclose(np.cross(bent, f).sum(axis=0), 0.0, atol=1e-10)


@settings(max_examples=10)
@given(st.integers(0, 10_000))
def test_stiffness_is_the_derivative_of_force(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, e = curved()
    bent, z = x + 0.002 * rng.normal(size=x.shape), rng.normal(size=x.shape)
    step = 1e-7
    difference = -(force(e, bent + step * z) - force(e, bent - step * z)) / (2 * step)
    product = stiffness(e, bent, z)
    assert np.linalg.norm(difference - product) < 1e-5 * np.linalg.norm(product)


def test_tension_of_a_pulled_strip_is_stiffness_times_strain() -> None:
    x, e = sheet_elements(6, 11, 0.02)
    pulled = x * np.array([1.0, 1.05, 1.0])
    end = np.isclose(x[:, 1], 0.0)
    tension = force(e, pulled)[end, 1].sum()
    width = 5 * 0.02
    assert tension == pytest.approx(STRETCH * 0.05 * width, rel=1e-6)


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_filtered_stiffness_never_gains_energy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, e = curved()
    crushed = x * rng.uniform(0.3, 1.5, size=3) + 0.004 * rng.normal(size=x.shape)
    block = prepare_filtered(e, STRETCH, crushed)
    z, product = rng.normal(size=x.shape), np.zeros_like(x)
    filtered_product(z, e.triangle_lanes, e.gradient_lanes, block, 1.0, product)
    assert np.sum(z * product) >= -1e-12


def test_filtered_stiffness_is_exact_under_tension() -> None:
    x, e = sheet_elements(5, 6, 0.03)
    pulled = x * np.array([1.1, 1.2, 1.0])
    block = prepare_filtered(e, STRETCH, pulled)
    z, product = np.random.default_rng(3).normal(size=x.shape), np.zeros_like(x)
    filtered_product(z, e.triangle_lanes, e.gradient_lanes, block, 1.0, product)
    exact = stiffness_product(e, STRETCH, 0.0, pulled, z)
    np.testing.assert_allclose(product, exact, atol=1e-9 * np.abs(exact).max())
