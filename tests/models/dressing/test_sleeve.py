"""Laws of the sleeve state and its derivatives."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.dressing.sleeve import (
    Center,
    loop_orientation,
    sleeve_state,
    sleeve_state_vjp,
)
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.garment.mesh import GarmentMesh

CENTERS: tuple[Center, Center] = ("arc_length", "keypoints")

seeds = st.integers(0, 2**31)
centers = st.sampled_from(CENTERS)
laws = settings(max_examples=30)


def random_loop(seed: int, nodes: int = 17) -> FloatArray:
    """Returns a wavy, unevenly spaced loop (nodes,3) of about 0.1 m radius."""
    rng = np.random.default_rng(seed)
    t = 2.0 * np.pi * (np.arange(nodes) + rng.uniform(-0.3, 0.3, nodes)) / nodes
    loop = 0.1 * np.stack([np.cos(t), np.sin(t), 0.2 * np.sin(3 * t)], axis=1)
    turned: FloatArray = Rotation.random(random_state=seed).apply(loop) + rng.normal(size=3)
    return turned


@laws
@given(seeds, centers)
def test_vjp_is_the_derivative(seed: int, center: Center) -> None:
    rng = np.random.default_rng(seed)
    x = np.vstack([rng.normal(size=(4, 3)), random_loop(seed)])
    loop = np.arange(4, len(x))
    p_bar, v_bar = rng.normal(size=3), rng.normal(size=3)

    def value(points: FloatArray) -> float:
        state = sleeve_state(points, loop, -1.0, center)
        return float(p_bar @ state.p_c + v_bar @ state.v_c)

    gradient = sleeve_state_vjp(x, loop, -1.0, p_bar, v_bar, center)
    eps = 1e-6
    for k in range(3):
        # keypoint 0 sits on node 0 and moves with it: no kink there
        direction = rng.normal(size=(len(loop), 3))
        step = np.zeros_like(x)
        step[loop] = eps * direction
        slope = (value(x + step) - value(x - step)) / (2.0 * eps)
        assert slope == pytest.approx(float(np.sum(gradient * direction)), rel=1e-5, abs=1e-6), k


@laws
@given(seeds, centers)
def test_state_moves_with_the_loop(seed: int, center: Center) -> None:
    rng = np.random.default_rng(seed)
    x, loop = random_loop(seed), np.arange(17)
    rotation, shift = Rotation.random(random_state=seed + 1).as_matrix(), rng.normal(size=3)
    state = sleeve_state(x, loop, 1.0, center)
    moved = sleeve_state(x @ rotation.T + shift, loop, 1.0, center)
    np.testing.assert_allclose(moved.p_c, rotation @ state.p_c + shift, atol=1e-10)
    np.testing.assert_allclose(moved.v_c, rotation @ state.v_c, atol=1e-10)
    assert np.linalg.norm(state.v_c) == pytest.approx(1.0, abs=1e-12)


@laws
@given(seeds)
def test_center_of_the_curve_does_not_depend_on_spacing(seed: int) -> None:
    x = random_loop(seed)
    state = sleeve_state(x, np.arange(17), 1.0)
    # five more nodes on one edge: the same curve
    extra = x[3] + np.linspace(0.0, 1.0, 7)[1:-1, None] * (x[4] - x[3])
    finer = np.vstack([x[:4], extra, x[4:]])
    refined = sleeve_state(finer, np.arange(len(finer)), 1.0)
    np.testing.assert_allclose(refined.p_c, state.p_c, atol=1e-12)
    np.testing.assert_allclose(refined.v_c, state.v_c, atol=1e-12)


@laws
@given(seeds)
def test_direction_of_counting_flips_only_the_orientation(seed: int) -> None:
    x, loop = random_loop(seed), np.arange(17)
    forward, backward = sleeve_state(x, loop, 1.0), sleeve_state(x, loop[::-1], 1.0)
    np.testing.assert_allclose(backward.p_c, forward.p_c, atol=1e-12)
    np.testing.assert_allclose(backward.v_c, -forward.v_c, atol=1e-12)
    np.testing.assert_allclose(sleeve_state(x, loop, -1.0).v_c, -forward.v_c, atol=1e-12)


def test_flat_circle_has_its_own_center_and_normal() -> None:
    t = 2.0 * np.pi * np.arange(24) / 24
    x = np.stack([0.1 * np.cos(t), 0.1 * np.sin(t), np.full(24, 0.4)], axis=1)
    for center in CENTERS:
        state = sleeve_state(x, np.arange(24), 1.0, center)
        np.testing.assert_allclose(state.p_c, [0.0, 0.0, 0.4], atol=1e-12)
        np.testing.assert_allclose(state.v_c, [0.0, 0.0, 1.0], atol=1e-12)


def test_moving_the_whole_loop_moves_the_center_by_as_much() -> None:
    for center in CENTERS:
        p_bar = np.array([1.0, -2.0, 3.0])
        x = random_loop(5)
        gradient = sleeve_state_vjp(x, np.arange(17), 1.0, p_bar, np.zeros(3), center)
        np.testing.assert_allclose(gradient.sum(axis=0), p_bar, atol=1e-12)
        turn = sleeve_state_vjp(x, np.arange(17), 1.0, np.zeros(3), p_bar, center)
        np.testing.assert_allclose(turn.sum(axis=0), 0.0, atol=1e-12)


@pytest.fixture(scope="module")
def coat() -> GarmentMesh:
    return make_coat(CoatParameters(), 0.05)


@pytest.mark.parametrize("side", ["left", "right"])
def test_orientation_points_from_cuff_to_armhole(coat: GarmentMesh, side: str) -> None:
    sign = loop_orientation(coat, side)
    state = sleeve_state(coat.rest_position, coat.loops[f"{side}_armhole"], sign)
    cuff = coat.rest_position[coat.loops[f"{side}_cuff"]].mean(axis=0)
    assert state.v_c @ (state.p_c - cuff) > 0.0
    # inward for both: the left sleeve is drawn to the right, the right one to the left
    assert np.sign(state.v_c[1]) == (-1.0 if side == "left" else 1.0)


def test_unusable_sides_and_openings_are_told(coat: GarmentMesh) -> None:
    with pytest.raises(UserError, match="side: is 'middle', expected one of left, right"):
        loop_orientation(coat, "middle")
    t = 2.0 * np.pi * np.arange(12) / 12
    flat = np.stack([np.cos(t), np.sin(t), 0.0 * t], axis=1)
    nodes = np.arange(12, dtype=np.int32)
    mesh = GarmentMesh(
        np.vstack([flat, flat + [5.0, 0.0, 0.0]]),
        np.zeros((0, 3), np.int32),
        {"left_armhole": nodes, "left_cuff": cast("IntArray", nodes + 12)},
        {},
        np.zeros(24, np.int8),
    )
    with pytest.raises(UserError, match=r"loops\.left_armhole: lies edge-on"):
        loop_orientation(mesh, "left")
