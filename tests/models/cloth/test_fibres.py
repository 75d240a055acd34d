from collections.abc import Sequence

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.fibres import Fibres, filtered_product
from tests.models.effects.scene import sheet_mesh


def fibres(
    direction: Sequence[float] = (0.0, 0.3, -1.0), stiffness: float = 200.0
) -> tuple[FloatArray, Elements, Fibres]:
    x, faces = sheet_mesh()
    elements = make_elements(x, faces)
    warp = np.tile(direction, (len(faces), 1))
    return x, elements, Fibres.along(elements, x, warp, stiffness)


def test_at_rest_there_is_neither_energy_nor_force() -> None:
    x, _, f = fibres()
    force = np.zeros_like(x)
    f.add_force(x, force)
    assert f.energy(x) == pytest.approx(0.0, abs=1e-20)
    np.testing.assert_allclose(force, 0.0, atol=1e-10)


def test_a_stretched_fibre_stores_half_k_strain_squared_a_area() -> None:
    x, elements, f = fibres((0.0, 0.0, 1.0))
    area = elements.triangle_area.sum()
    assert f.energy(1.1 * x) == pytest.approx(0.5 * 200.0 * 0.1**2 * area)


def test_force_is_minus_the_derivative_of_energy_and_rigid_motion_is_free() -> None:
    x, _, f = fibres()
    rng = np.random.default_rng(0)
    bent = x + 0.01 * rng.standard_normal(x.shape)
    force = np.zeros_like(x)
    f.add_force(bent, force)
    d = rng.standard_normal(x.shape)
    slope = (f.energy(bent + 1e-6 * d) - f.energy(bent - 1e-6 * d)) / 2e-6
    assert np.sum(force * d) == pytest.approx(-slope, rel=1e-6)
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-10)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    assert f.energy(bent @ turn.T + 1.0) == pytest.approx(f.energy(bent))


def test_filtered_stiffness_is_exact_in_tension_and_never_negative() -> None:
    x, _, f = fibres((0.0, 0.0, 1.0))
    rng = np.random.default_rng(1)
    d = rng.standard_normal(x.shape)
    for stretch, exact in ((1.2, True), (0.8, False)):
        at = stretch * x
        out, above, below = np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
        block = f.prepare(at)
        filtered_product(d, f.triangle, f.coefficient, f.weight, block, 1.0, out)
        f.add_force(at + 1e-6 * d, above)
        f.add_force(at - 1e-6 * d, below)
        assert np.sum(d * out) >= 0.0
        if exact:
            np.testing.assert_allclose(out, (below - above) / 2e-6, atol=2e-4)
        # the constant matrix bounds it
        bound = f.matrix(len(x)) @ d
        assert np.sum(d * out) <= np.sum(d * bound) + 1e-9


def test_a_triangle_that_the_direction_is_normal_to_gets_no_fibre() -> None:
    _, _, f = fibres((0.0, 1.0, 0.0))
    np.testing.assert_array_equal(f.weight, 0.0)
