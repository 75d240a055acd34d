"""Observed sleeves are those of the garment's nodes."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.dressing.sleeve import loop_orientation, sleeve_state
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.sides import SIDES
from drake_dress.systems.sleeve_observer import SleeveObserver
from tests.models.human.learned.drawn import about_vertical

MESH = make_coat(CoatParameters(), 0.06)
OBSERVER = SleeveObserver(MESH)
seeds = st.integers(0, 2**32 - 1)


def observed(x: np.ndarray) -> np.ndarray:
    context = OBSERVER.CreateDefaultContext()
    OBSERVER.get_input_port().FixValue(context, x.ravel())
    return OBSERVER.get_output_port().Eval(context).reshape(2, 6)


@given(seeds, st.floats(0.0, 0.05))
@settings(max_examples=20)
def test_centres_and_directions_are_the_sleeves_left_then_right(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    x = MESH.rest_position + size * rng.normal(size=MESH.rest_position.shape)
    found = observed(x)
    for row, side in zip(found, SIDES, strict=True):
        loop = np.asarray(MESH.loops[f"{side}_armhole"])
        state = sleeve_state(x, loop, loop_orientation(MESH, side))
        np.testing.assert_array_equal(row[:3], state.p_c)
        np.testing.assert_array_equal(row[3:], state.v_c)


@given(seeds, st.floats(-3.0, 3.0))
@settings(max_examples=20)
def test_sleeves_go_with_a_garment_that_is_moved_and_turned(seed: int, yaw: float) -> None:
    rng = np.random.default_rng(seed)
    turn, shift = about_vertical(yaw).T, rng.normal(size=3)
    rest, moved = observed(MESH.rest_position), observed(MESH.rest_position @ turn + shift)
    np.testing.assert_allclose(moved[:, :3], rest[:, :3] @ turn + shift, atol=1e-12)
    np.testing.assert_allclose(moved[:, 3:], rest[:, 3:] @ turn, atol=1e-12)


def test_directions_are_of_unit_length_from_cuff_to_armhole() -> None:
    for row, side in zip(observed(MESH.rest_position), SIDES, strict=True):
        np.testing.assert_allclose(np.linalg.norm(row[3:]), 1.0)
        cuff = MESH.rest_position[MESH.loops[f"{side}_cuff"]].mean(axis=0)
        assert (row[:3] - cuff) @ row[3:] > 0.0
