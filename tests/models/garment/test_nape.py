"""The point of a garment that lies on the wearer's nape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.nape import find_nape


@pytest.mark.parametrize("preset", ["jacket", "overcoat"])
@given(spacing=st.floats(0.03, 0.06), height=st.floats(0.02, 0.12), neck=st.floats(0.12, 0.24))
@settings(max_examples=8)
def test_it_is_the_middle_of_the_collars_edge(
    preset: str, spacing: float, height: float, neck: float
) -> None:
    coat = replace(COATS[preset], collar_height=height, neck_width=neck)
    mesh = make_coat(coat, spacing)
    found = find_nape(mesh.rest_position, mesh.faces, mesh.loops)
    assert found is not None
    point = found.at(mesh.rest_position)
    collar = mesh.rest_position[mesh.region == 3]
    assert abs(point[1]) < 1e-9
    # the neckline dips by 1 cm at the back
    assert point[2] == pytest.approx(collar[:, 2].max() - 0.01, abs=0.1 * height + 0.003)
    assert point[0] < 0.0
    assert found.weights.sum() == pytest.approx(1.0)
    # the neckline is 1 cm below the shoulder seam's inner end, 4 cm above the tips
    assert found.height == pytest.approx(height - 0.015, abs=0.02)


@pytest.mark.parametrize("spacing", [0.02, 0.05])
def test_that_of_a_hood_is_where_it_begins_and_not_its_edge(spacing: float) -> None:
    mesh = make_coat(COATS["raincoat"], spacing)
    found = find_nape(mesh.rest_position, mesh.faces, mesh.loops)
    assert found is not None
    assert found.height == 0.0
    x, hood = mesh.rest_position, mesh.region == 3
    point = found.at(x)
    back = np.abs(x[:, 1]) < 1e-9
    seam = x[back & hood & (x[:, 0] < 0.0), 2].min()
    assert point[2] == pytest.approx(seam, abs=1.2 * spacing)
    assert abs(point[1]) < 1e-9
    assert point[0] < 0.0


def test_it_moves_with_the_garment() -> None:
    mesh = make_coat(COATS["jacket"], 0.03)
    found = find_nape(mesh.rest_position, mesh.faces, mesh.loops)
    moved = find_nape(mesh.rest_position + [0.3, -0.4, 1.0], mesh.faces, mesh.loops)
    assert found is not None
    assert moved is not None
    shifted = found.at(mesh.rest_position + [0.3, -0.4, 1.0])
    np.testing.assert_allclose(moved.at(mesh.rest_position + [0.3, -0.4, 1.0]), shifted)


def test_that_of_a_gown_lies_on_the_throat() -> None:
    coat = make_coat(COATS["jacket"], 0.03)
    gown = coat.opened_at_back()
    found, of_coat = (find_nape(m.rest_position, m.faces, m.loops) for m in (gown, coat))
    assert found is not None
    assert of_coat is not None
    assert found.in_front
    assert not of_coat.in_front
    mirrored = of_coat.at(coat.rest_position) * [-1.0, 1.0, 1.0]
    np.testing.assert_allclose(found.at(gown.rest_position), mirrored, atol=1e-12)


def test_a_garment_without_an_edge_above_the_armholes_has_none() -> None:
    mesh = make_coat(COATS["jacket"], 0.03)
    upside_down = mesh.rest_position * [1.0, 1.0, -1.0]
    below = np.where(upside_down[:, 2] > 0.0, upside_down[:, 2], 0.0)
    flat = np.column_stack([upside_down[:, :2], np.minimum(below, 0.0)])
    assert find_nape(flat, mesh.faces, mesh.loops) is None
