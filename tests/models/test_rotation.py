"""Rotations keep their axis, add up, and turn by the right hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.rotation import rotation_about

ANGLES = st.floats(-10.0, 10.0)
E = np.eye(3)


@given(st.sampled_from("xyz"), ANGLES, ANGLES)
def test_rotations_about_an_axis_are_orthogonal_and_add_up(axis: str, a: float, b: float) -> None:
    turned, kept = rotation_about(axis, a), E["xyz".index(axis)]
    np.testing.assert_allclose(turned @ turned.T, E, atol=1e-12)
    np.testing.assert_array_equal(turned @ kept, kept)
    np.testing.assert_allclose(
        turned @ rotation_about(axis, b), rotation_about(axis, a + b), atol=1e-12
    )


@pytest.mark.parametrize(("axis", "start", "end"), [("x", 1, 2), ("y", 2, 0), ("z", 0, 1)])
def test_a_quarter_turn_takes_one_axis_to_the_next(axis: str, start: int, end: int) -> None:
    np.testing.assert_allclose(rotation_about(axis, 0.5 * np.pi) @ E[start], E[end], atol=1e-15)
