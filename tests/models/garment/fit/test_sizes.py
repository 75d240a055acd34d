"""Measures of a garment are those it was cut with, grow with its scale, and ignore its mesh."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from drake_dress.models.garment.coat import COATS, CoatParameters, make_coat
from drake_dress.models.garment.fit.sizes import GarmentSizes, garment_sizes
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES
from tests.closed_coat import closed_coat
from tests.present import present

JACKET = make_coat(COATS["jacket"], 0.04)


def lengths(sizes: GarmentSizes) -> dict[str, Any]:
    """Returns all measures that are lengths, by name."""
    found = {f"girth of {loop.name}": loop.girth for loop in sizes.loops}
    for entry in fields(sizes):
        value = getattr(sizes, entry.name)
        if isinstance(value, float) and entry.name != "area":
            found[entry.name] = value
    found |= {f"{side} sleeve": sizes.sleeve_length[side] for side in SIDES}
    found |= dict(zip("depth width height".split(), sizes.extent.tolist(), strict=True))
    return found | dict(zip("least median most".split(), sizes.edges, strict=True))


@pytest.mark.parametrize("preset", ["jacket", "overcoat"])
@pytest.mark.parametrize("spacing", [0.03, 0.05])
def test_measures_are_those_of_the_pattern(preset: str, spacing: float) -> None:
    p: CoatParameters = COATS[preset]
    sizes = garment_sizes(make_coat(p, spacing))
    for side in SIDES:
        assert sizes.girth(f"{side}_cuff") == pytest.approx(p.cuff_girth, rel=1e-3)
        assert sizes.girth(f"{side}_armhole") == pytest.approx(p.armhole_girth, rel=1e-2)
        assert sizes.sleeve_length[side] == pytest.approx(p.sleeve_length, rel=1e-3)
    assert sizes.shoulder_width == pytest.approx(p.shoulder_width)
    assert sizes.body_length == pytest.approx(p.body_length)
    assert sizes.chest + present(sizes.front_gap) == pytest.approx(p.chest, rel=1e-2)
    # the lapels lean outward a little below the seams' inner ends
    assert p.neck_width < present(sizes.neck_width) < p.neck_width + 0.03
    # the armholes curve in across the back
    assert 0.85 * p.shoulder_width < sizes.back_width < p.shoulder_width
    assert sizes.asymmetry == pytest.approx(0.0, abs=1e-9)


def test_a_garment_of_twice_the_size_has_twice_the_lengths_and_four_times_the_area() -> None:
    small, large = garment_sizes(JACKET), garment_sizes(JACKET.scaled(2.0))
    other = lengths(large)
    for name, value in lengths(small).items():
        assert other[name] == pytest.approx(2.0 * value, rel=1e-9), name
    assert large.area == pytest.approx(4.0 * small.area)
    for before, after in zip(small.loops, large.loops, strict=True):
        assert np.allclose(2.0 * before.center, after.center)


def test_the_order_of_nodes_and_faces_does_not_matter() -> None:
    rng = np.random.default_rng(3)
    new = rng.permutation(len(JACKET.rest_position)).astype(np.int32)
    old = np.argsort(new)
    shuffled = GarmentMesh(
        JACKET.rest_position[old],
        new[rng.permutation(JACKET.faces)],
        {name: new[loop] for name, loop in JACKET.loops.items()},
        {side: new[nodes] for side, nodes in JACKET.grasp.items()},
        JACKET.region[old],
    )
    expected = lengths(garment_sizes(JACKET))
    for name, value in lengths(garment_sizes(shuffled)).items():
        assert value == pytest.approx(expected[name], abs=1e-9), name


def test_a_coarser_mesh_gives_the_same_distances_over_the_cloth() -> None:
    alone = garment_sizes(JACKET)
    beside = garment_sizes(JACKET, make_coat(COATS["jacket"], 0.06))
    assert beside.back_width == pytest.approx(alone.back_width, rel=0.02)
    assert beside.sleeve_length["left"] == pytest.approx(alone.sleeve_length["left"], rel=0.02)
    assert beside.girth("left_cuff") == alone.girth("left_cuff")
    assert beside.node_count == len(JACKET.rest_position)


def test_a_closed_front_adds_cloth_around_the_chest() -> None:
    opened, closed = garment_sizes(JACKET), garment_sizes(closed_coat(JACKET))
    assert closed.opening == "closed"
    assert closed.front_gap is None
    assert closed.chest == pytest.approx(opened.chest + present(opened.front_gap), rel=1e-3)
    assert {loop.name for loop in closed.loops} >= {"neck", "hem"}


def test_a_shorter_sleeve_is_told_of_its_side_alone() -> None:
    x = JACKET.rest_position.copy()
    sleeve = JACKET.region == 1
    root = x[JACKET.loops["left_armhole"]].mean(axis=0)
    x[sleeve] = root + 0.6 * (x[sleeve] - root)
    sizes = garment_sizes(replace(JACKET, rest_position=x))
    assert sizes.sleeve_length["left"] < 0.75 * sizes.sleeve_length["right"]
    assert sizes.sleeve_length["right"] == pytest.approx(COATS["jacket"].sleeve_length, rel=1e-3)
    assert sizes.asymmetry > 5e-3


def test_the_girth_of_a_round_loop_is_that_of_its_polygon() -> None:
    cuff = JACKET.loops["left_cuff"]
    angle = 2.0 * np.pi * np.arange(len(cuff)) / len(cuff)
    x = JACKET.rest_position.copy()
    x[cuff] = x[cuff].mean(axis=0) + 0.06 * np.stack(
        [np.cos(angle), np.sin(angle), np.zeros(len(cuff))], axis=1
    )
    girth = garment_sizes(replace(JACKET, rest_position=x)).girth("left_cuff")
    assert girth == pytest.approx(2.0 * len(cuff) * 0.06 * np.sin(np.pi / len(cuff)))
