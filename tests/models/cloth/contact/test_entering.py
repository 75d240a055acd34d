"""Nothing ends up inside a person because it was not seen to come: fast nodes, and hollows."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.distance import nearest_obstacle
from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.state import ClothState
from tests.models.cloth.sheets import NO_NODES, sheet_elements

H = 0.008


def depth(x: FloatArray, bodies: Obstacles) -> float:
    """Returns how deep the deepest node is inside, m."""
    distance, owner = np.empty(len(x)), np.empty(len(x), dtype=np.int32)
    nearest_obstacle(x, bodies.packed, distance, owner)
    return max(0.0, -float(distance.min()))


def capsules(*ends: tuple[FloatArray, FloatArray], radius: float) -> Obstacles:
    a, b = (np.array([e[k] for e in ends]) for k in (0, 1))
    return Obstacles.resting(a, b, np.full(len(ends), radius))


@settings(max_examples=10)
@given(st.floats(60.0, 160.0), st.floats(2.0, 15.0), st.integers(0, 1000))
def test_cloth_pressed_into_the_hollow_of_two_limbs_stays_outside(
    angle: float, pull: float, seed: int
) -> None:
    """Arms of a V below a sheet that a force presses down: shoulder and upper arm."""
    x, e = sheet_elements(9, 9, 0.025)
    rng = np.random.default_rng(seed)
    start = x - x.mean(axis=0)
    half = np.deg2rad(angle) / 2.0
    one = np.array([np.sin(half), 0.0, np.cos(half)])
    other = one * np.array([-1.0, 1.0, 1.0])
    bodies = capsules((np.zeros(3), 0.5 * one), (np.zeros(3), 0.5 * other), radius=0.045)
    start[:, 2] = 0.12 + 0.001 * rng.normal(size=len(start))
    start[:, :2] *= 0.3
    cloth = ImplicitCloth(
        e,
        Material(stretch_stiffness=1500.0, damping=0.003),
        H,
        NO_NODES,
        np.array([0.0, 0.0, -9.81 * pull]),
        settings=ImplicitSettings(tolerance=2e-2, implicitness=0.7, buckling_wavelength=3.0),
    )
    deepest, state = 0.0, ClothState.at_rest(start)
    lift = 0.2 / np.cos(half)
    state = replace(state, x=state.x + np.array([0.0, 0.0, min(lift, 0.4)]))
    for k in range(60):
        state, _ = cloth.step(state, bodies, np.zeros((0, 3)))
        if k > 0:
            deepest = max(deepest, depth(state.x, bodies))
    assert deepest < 3e-3


@pytest.mark.parametrize("speed", [0.5, 2.0, 6.0])
def test_a_sheet_thrown_at_a_limb_does_not_enter(speed: float) -> None:
    x, e = sheet_elements(9, 9, 0.025)
    start = x - x.mean(axis=0)
    start[:, 2] = 0.09
    rng = np.random.default_rng(0)
    bodies = capsules((np.array([-0.3, 0, 0]), np.array([0.3, 0, 0])), radius=0.06)
    cloth = ImplicitCloth(
        e,
        Material(stretch_stiffness=1500.0),
        H,
        NO_NODES,
        settings=ImplicitSettings(implicitness=0.7),
    )
    v = np.tile([0.0, 0.0, -speed], (len(x), 1)) + 0.2 * speed * rng.normal(size=x.shape)
    state = replace(ClothState.at_rest(start), v=v)
    deepest = 0.0
    for _ in range(40):
        state, _ = cloth.step(state, bodies, np.zeros((0, 3)))
        deepest = max(deepest, depth(state.x, bodies))
    assert deepest < 1e-3


@pytest.mark.parametrize("friction", [0.0, 0.2])
@pytest.mark.parametrize("angle", [50.0, 90.0, 130.0])
def test_what_slides_from_one_surface_to_another_goes_on_along_where_they_meet(
    angle: float, friction: float
) -> None:
    """A floor and a wall on it: a sheet that reaches the wall keeps its way along both."""
    x, e = sheet_elements(3, 3, 0.025)
    material = Material(stretch_stiffness=1500.0, friction=friction)
    start = x - x.max(axis=0)
    start[:, 2] = material.margin
    lean = np.deg2rad(angle)
    normals = np.array([[0.0, 0.0, 1.0], [-np.sin(lean), 0.0, np.cos(lean)]])
    planes = HalfSpaces.resting(np.array([np.zeros(3), [0.01, 0.0, 0.0]]), normals)
    bodies = replace(Obstacles.none(), half_spaces=planes)
    cloth = ImplicitCloth(
        e, material, H, NO_NODES, settings=ImplicitSettings(tolerance=1e-6, implicitness=0.7)
    )
    # pressed to the floor by a step, then thrown
    state, _ = cloth.step(ClothState.at_rest(start), bodies, np.zeros((0, 3)))
    state = replace(state, v=np.tile([2.0, 1.0, 0.0], (len(x), 1)))
    before = 1.0
    for k in range(4):
        state, _ = cloth.step(state, bodies, np.zeros((0, 3)))
        assert depth(state.x, bodies) < 1e-3
        along = state.v[:, 1] @ cloth.mass / cloth.mass.sum()
        if friction == 0.0:
            assert along == pytest.approx(1.0, abs=1e-3)
        else:
            assert -1e-3 < along < before
        if k == 0:
            # reached the wall just now, which nothing holds on to
            assert along > 0.9
        before = along
