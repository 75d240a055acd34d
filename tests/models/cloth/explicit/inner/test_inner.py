"""What every inner iteration has to hold: its limit, its contact, its derivatives."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.modes import FREE, SLIP, STICK
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.explicit.explicit_bias import (
    ContactTypes,
    ExplicitBiasCloth,
    ExplicitSettings,
)
from drake_dress.models.cloth.explicit.inner.one_step import OneStep
from drake_dress.models.cloth.material import Material
from tests.models.cloth.sheets import sheet_elements

HELD = np.array([0, 1, 17, 16], dtype=np.int32)
MATERIAL = Material(surface_density=0.25, stretch_stiffness=80.0, bending_stiffness=3e-4)
SCHEMES = (("one_step", 1), ("stationary", 3), ("conjugate_gradients", 200), ("direct", 1))


def limb() -> Obstacles:
    return Obstacles(
        np.array([[0.1, 0.2, -0.055], [0.3, 0.1, -0.06]]),
        np.array([[0.4, 0.3, -0.055], [0.3, 0.1, -0.06]]),
        np.array([0.05, 0.05]),
        np.array([[0.0, 0.0, 0.05], [0.02, 0.0, 0.0]]),
        np.array([[0.1, 0.2, 0.3], [0.0, 0.0, 0.0]]),
    )


def draped(h: float) -> tuple[Elements, FloatArray, FloatArray, FloatArray]:
    """A sheet that its grippers pull over two limbs."""
    x, e = sheet_elements(16, 18, 0.03)
    cloth = ExplicitBiasCloth(e, MATERIAL, 0.01, HELD)
    v = np.zeros_like(x)
    motion = np.tile([0.05, 0.02, -0.1], (4, 1))
    for _ in range(40):
        x, v, _, _ = cloth.step(x, v, 0.01 * motion, limb())
    rng = np.random.default_rng(1)
    return e, x, v + 0.02 * rng.normal(size=v.shape), h * motion


def make(
    e: Elements, h: float, name: str, iterations: int, m: Material = MATERIAL
) -> ExplicitBiasCloth:
    return ExplicitBiasCloth(
        e, m, h, HELD, settings=ExplicitSettings(tolerance=1e-12, iterations=iterations, inner=name)
    )


@pytest.mark.parametrize(("h", "enough"), [(0.001, 300), (0.01, 2000), (0.1, 16000)])
def test_iterations_reach_the_direct_solution(h: float, enough: int) -> None:
    """The limit of the K-iteration scheme and of its acceleration, to 1e-9."""
    e, x, v, motion = draped(h)
    limit = make(e, h, "direct", 1).step(x, v, motion, Obstacles.none())
    size = np.abs(limit[0] - x).max()
    for name, iterations in (("stationary", enough), ("conjugate_gradients", 500)):
        found = make(e, h, name, iterations).step(x, v, motion, Obstacles.none())
        assert np.abs(found[0] - limit[0]).max() < 1e-9 * size, name
        assert np.abs(found[1] - limit[1]).max() < 1e-9 * np.abs(limit[1]).max(), name


def test_iterations_reach_the_direct_solution_in_contact() -> None:
    h = 0.005
    e, x, v, motion = draped(h)
    limit = make(e, h, "direct", 1)
    tape = limit.step(x, v, motion, limb())[3]
    assert {STICK, SLIP, FREE} >= set(tape.types.mode) >= {SLIP}
    expected = limit.step(x, v, motion, limb(), tape.types)
    for name, iterations in (("stationary", 500), ("conjugate_gradients", 500)):
        found = make(e, h, name, iterations).step(x, v, motion, limb(), tape.types)
        for a, b in zip(found[:3], expected[:3], strict=True):
            assert np.abs(a - b).max() < 1e-7 * np.abs(b).max(), name


def test_more_iterations_come_closer() -> None:
    e, x, v, motion = draped(0.02)
    nothing = Obstacles.none()
    limit = make(e, 0.02, "direct", 1).step(x, v, motion, nothing)[0]
    for name in ("stationary", "conjugate_gradients"):
        distance = [
            np.linalg.norm(make(e, 0.02, name, k).step(x, v, motion, nothing)[0] - limit)
            for k in (2, 4, 8, 16)
        ]
        assert np.all(np.diff(distance) < 0.0), name


@pytest.mark.parametrize(("name", "iterations"), SCHEMES)
def test_sticking_nodes_follow_and_slipping_ones_keep_their_gap(name: str, iterations: int) -> None:
    e, x, v, motion = draped(0.02)
    x1, v1, reaction, tape = make(e, 0.02, name, iterations).step(x, v, motion, limb())
    late = tape.friction.velocity_mode
    c, mode = tape.contacts, tape.friction.mode
    moved = (x1 - x)[c.nodes]
    np.testing.assert_allclose(moved[mode == STICK], tape.prescribed[mode == STICK], atol=1e-9)
    slip = mode == SLIP
    gap = np.einsum("ij,ij->i", moved[slip] - tape.prescribed[slip], c.normal[slip])
    np.testing.assert_allclose(gap, 0.0, atol=1e-9)
    faster = v1[c.nodes] - c.surface_velocity
    np.testing.assert_allclose(faster[late == STICK], 0.0, atol=1e-9)
    into = np.einsum("ij,ij->i", faster, c.normal)[late == SLIP]
    np.testing.assert_allclose(into, 0.0, atol=1e-9)
    np.testing.assert_array_equal(reaction[c.nodes[mode == FREE]], 0.0)


@pytest.mark.parametrize("h", [0.005, 0.05])
@pytest.mark.parametrize(("name", "iterations"), [s for s in SCHEMES if s[0] != "stationary"])
def test_derivatives_match_finite_differences(name: str, iterations: int, h: float) -> None:
    """By positions, velocities, grippers and every value of the material, in contact."""
    rng = np.random.default_rng(7)
    e, x, v, motion = draped(h)
    types = make(e, h, name, iterations).step(x, v, motion, limb())[3].types
    weight_x, weight_v = rng.normal(size=x.shape), h * rng.normal(size=x.shape)
    weight_r = 1e-3 * rng.normal(size=motion.shape)

    def loss(
        x: FloatArray, v: FloatArray, motion: FloatArray, m: Material, types: ContactTypes
    ) -> float:
        x1, v1, r, _ = make(e, h, name, iterations, m).step(x, v, motion, limb(), types)
        value = np.sum(weight_x * x1) + np.sum(weight_v * v1) + np.sum(weight_r * r[HELD])
        return float(value)

    cloth = make(e, h, name, iterations)
    tape = cloth.step(x, v, motion, limb(), types)[3]
    g = cloth.vector_jacobian_product(tape, weight_x, weight_v, weight_r, by_material=True)
    at: dict[str, Any] = {"x": x, "v": v, "motion": motion, "m": MATERIAL, "types": types}
    for key, point, slope in (("x", x, g.x), ("v", v, g.v), ("motion", motion, g.held_motion)):
        numeric, exact = [], []
        for _ in range(5):
            # A depends on positions with kinks where an element is unstrained: stay short of them.
            d, step = rng.normal(size=point.shape), 1e-8 if key == "x" else 1e-6
            high, low = (loss(**{**at, key: point + s * step * d}) for s in (1.0, -1.0))
            numeric.append((high - low) / (2 * step))
            exact.append(float(np.sum(slope * d)))
        error = np.linalg.norm(np.subtract(numeric, exact))
        assert error < 1e-3 * np.linalg.norm(numeric), key
    for key, value in g.material.items():
        step = 1e-3 * getattr(MATERIAL, key)
        high, low = (
            loss(**{**at, "m": replace(MATERIAL, **{key: getattr(MATERIAL, key) + s * step})})
            for s in (1.0, -1.0)
        )
        assert value == pytest.approx((high - low) / (2 * step), rel=1e-3, abs=1e-6), key
    assert set(g.material) == {
        "stretch_stiffness",
        "bending_stiffness",
        "surface_density",
        "friction",
        "margin",
    }


@pytest.mark.parametrize("h", [0.005, 0.05])
def test_derivatives_of_the_stationary_scheme_match_in_free_motion_and_in_sticking(
    h: float,
) -> None:
    rng = np.random.default_rng(7)
    e, x, v, motion = draped(h)
    rough = replace(MATERIAL, friction=1e3)
    cloth = make(e, h, "stationary", 3, rough)
    types = cloth.step(x, v, motion, limb())[3].types
    assert set(types.mode) == {FREE, STICK}
    weight_x, weight_v = rng.normal(size=x.shape), h * rng.normal(size=x.shape)

    def loss(x: FloatArray, m: Material) -> float:
        c = make(e, h, "stationary", 3, m)
        x1, v1, _, _ = c.step(x, v, motion, limb(), types)
        return float(np.sum(weight_x * x1) + np.sum(weight_v * v1))

    tape = cloth.step(x, v, motion, limb(), types)[3]
    g = cloth.vector_jacobian_product(tape, weight_x, weight_v, np.zeros_like(motion), True)
    numeric, exact = [], []
    for _ in range(5):
        d = rng.normal(size=x.shape)
        numeric.append((loss(x + 1e-8 * d, rough) - loss(x - 1e-8 * d, rough)) / 2e-8)
        exact.append(float(np.sum(g.x * d)))
    assert np.linalg.norm(np.subtract(numeric, exact)) < 1e-3 * np.linalg.norm(numeric)
    for key in ("stretch_stiffness", "bending_stiffness", "surface_density"):
        step = 1e-3 * getattr(rough, key)
        high, low = (
            loss(x, replace(rough, **{key: getattr(rough, key) + s * step})) for s in (1.0, -1.0)
        )
        assert g.material[key] == pytest.approx((high - low) / (2 * step), rel=1e-3), key


def test_stationary_scheme_says_that_it_has_no_derivative_through_slipping() -> None:
    e, x, v, motion = draped(0.02)
    cloth = make(e, 0.02, "stationary", 3)
    tape = cloth.step(x, v, motion, limb())[3]
    assert SLIP in tape.types.mode
    with pytest.raises(ValueError, match="no derivative through slipping contact"):
        cloth.vector_jacobian_product(tape, x, v, np.zeros_like(motion))


@pytest.mark.parametrize("h", [0.005, 0.05])
def test_all_routes_through_contact_lead_to_the_same_step_and_derivative(h: float) -> None:
    """Few contacts: by the columns that they reach; many: by a factor without them, or by two."""
    rng = np.random.default_rng(3)
    e, x, v, motion = draped(h)
    weight = rng.normal(size=x.shape)
    found = []
    for many, many_slipping in ((10**6, 0), (0, 10**6), (0, 0)):
        cloth = make(e, h, "one_step", 1)
        assert isinstance(cloth.inner, OneStep)
        cloth.inner.many, cloth.inner.many_slipping = many, many_slipping
        x1, v1, r, tape = cloth.step(x, v, motion, limb())
        assert {SLIP, FREE} <= set(tape.types.mode)
        g = cloth.vector_jacobian_product(tape, weight, h * weight, 1e-3 * r[HELD], True)
        found.append((x1, v1, r, g.x, g.v, g.held_motion, np.array(list(g.material.values()))))
    for other in found[1:]:
        for a, b in zip(found[0], other, strict=True):
            assert np.abs(a - b).max() < 1e-7 * np.abs(a).max()
