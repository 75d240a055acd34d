"""A coat opens in front, a joined front is closed, and a coat turned about opens at the back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.fit.front import find_openings
from drake_dress.models.garment.mesh import GarmentMesh
from tests.closed_coat import closed_coat

JACKET = make_coat(COATS["jacket"], 0.04)


def turned_about(mesh: GarmentMesh) -> GarmentMesh:
    """Returns a garment with front and back exchanged, and left and right named anew."""
    other = {"left": "right", "right": "left"}
    loops = {
        f"{other[side]}_{name}": mesh.loops[f"{side}_{name}"]
        for side in other
        for name in ("armhole", "cuff")
    }
    region = np.array([0, 2, 1, 3], dtype=np.int8)[mesh.region]
    return replace(mesh, rest_position=mesh.rest_position * [-1, -1, 1], loops=loops, region=region)


@pytest.mark.parametrize("spacing", [0.025, 0.06])
@pytest.mark.parametrize("preset", COATS)
def test_every_coat_opens_where_it_was_cut(preset: str, spacing: float) -> None:
    mesh = make_coat(COATS[preset], spacing)
    found = find_openings(mesh)
    assert found.opening == COATS[preset].opens
    assert list(found.loops) == ["rim"]
    # with the cuffs, that is the whole border
    named = sum(len(loop) for loop in found.loops.values())
    cuffs = len(mesh.loops["left_cuff"]) + len(mesh.loops["right_cuff"])
    assert named + cuffs == sum(len(loop) for loop in boundary_loops(mesh.faces))


def test_a_front_that_is_joined_all_along_is_closed() -> None:
    found = find_openings(closed_coat(JACKET))
    assert found.opening == "closed"
    assert list(found.loops) == ["neck", "hem"]
    z = JACKET.rest_position[:, 2]
    assert z[found.loops["hem"]].max() < z[found.loops["neck"]].min()


def test_a_slit_below_a_joined_chest_is_closed_still() -> None:
    assert find_openings(closed_coat(JACKET, 0.6)).opening == "closed"


def test_a_coat_turned_about_opens_at_the_back() -> None:
    found = find_openings(turned_about(JACKET))
    assert found.opening == "back"
    assert list(found.loops) == ["rim"]


@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_size_does_not_matter(factor: float) -> None:
    assert find_openings(JACKET.scaled(factor)).opening == "front"
    assert find_openings(closed_coat(JACKET).scaled(factor)).opening == "closed"


def test_a_hole_is_an_opening_of_its_own() -> None:
    body = (JACKET.region[JACKET.faces] == 0).all(axis=1)
    border = np.unique(np.concatenate(boundary_loops(JACKET.faces)))
    inner = body & ~np.isin(JACKET.faces, border).any(axis=1)
    holed = replace(JACKET, faces=np.delete(JACKET.faces, np.flatnonzero(inner)[40], axis=0))
    found = find_openings(holed)
    assert found.opening == "front"
    assert list(found.loops) == ["rim", "opening_1"]
    assert len(found.loops["opening_1"]) == 3
