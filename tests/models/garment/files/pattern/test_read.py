"""A pattern becomes a worn garment whose cloth keeps the size of its flat panels."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.layers.piercing import piercing_edges
from drake_dress.models.garment.files.pattern.read import read_pattern
from drake_dress.models.garment.files.pattern.sewing import sewn
from drake_dress.models.garment.files.pattern.specification import parse_pattern
from drake_dress.models.garment.files.pattern.worn import worn
from drake_dress.models.garment.load import load_garment
from drake_dress.models.garment.mesh import loop_length
from tests.models.garment.files.pattern.small_coat import changed, small_coat, written


def test_a_worn_coat_keeps_its_panels_sizes_and_has_the_openings_of_a_coat(
    tmp_path: Path,
) -> None:
    seen: list[float] = []
    mesh = load_garment(
        written(tmp_path), unit="cm", up="y", progress=lambda _stage, share: seen.append(share)
    )
    mesh.validate()
    assert len(seen) > 10
    x = mesh.rest_position
    for side, sign in (("left", 1.0), ("right", -1.0)):
        cuff, armhole = mesh.loops[f"{side}_cuff"], mesh.loops[f"{side}_armhole"]
        assert loop_length(x, cuff) == pytest.approx(0.30, rel=0.03)
        # the line that is found runs near the seam, which is 0.43 m long
        assert 0.38 < loop_length(x, armhole) < 0.56
        assert (sign * x[armhole, 1] > 0).all()
        assert sign * (x[cuff, 1].mean() - x[armhole, 1].mean()) > 0.25
    # all cloth is there: two fronts, the back and four half sleeves
    a, b, c = (x[mesh.faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    # curved edges take 1 % of the panels' polygons
    assert area == pytest.approx(polygons(), rel=0.02)


def polygons() -> float:
    """Returns the area of the panels with straight edges, m²."""
    total = 0.0
    for panel in small_coat()["pattern"]["panels"].values():
        x, y = np.array(panel["vertices"]).T
        total += 0.5 * abs(x @ np.roll(y, -1) - np.roll(x, -1) @ y)
    return 1e-4 * total


def tube() -> bytes:
    """Two panels, 20 × 30 cm, sewn along both long sides."""
    panel = {
        "vertices": [[-10, 0], [10, 0], [10, 30], [-10, 30]],
        "edges": [{"endpoints": [i, (i + 1) % 4]} for i in range(4)],
    }
    panels = {
        "front": panel | {"translation": [0, 0, 12], "rotation": [0, 0, 0]},
        "back": panel | {"translation": [0, 0, -12], "rotation": [0, 180, 0]},
    }
    pairs = [(1, 3), (3, 1)]
    stitches = [[{"panel": "front", "edge": i}, {"panel": "back", "edge": j}] for i, j in pairs]
    return json.dumps({"pattern": {"panels": panels, "stitches": stitches}}).encode()


def shape() -> tuple[FloatArray, FloatArray]:
    """The tube's worn shape, and the relative strain of its edges."""
    s = sewn(parse_pattern(tube(), "tube.json"), 0.03)
    x = worn(s, lambda _share: None)
    e = make_elements(s.position, s.faces, s.corners)
    length = np.linalg.norm(x[e.edge[:, 0]] - x[e.edge[:, 1]], axis=1)
    assert len(piercing_edges(x, e)) == 0
    return x, length / e.edge_rest_length - 1.0


def test_a_tube_is_round_keeps_its_lengths_and_is_the_same_each_time() -> None:
    x, strain = shape()
    assert np.abs(strain).max() < 0.02
    assert np.median(np.abs(strain)) < 0.005
    # 40 cm around: a circle has 12.7 cm across; flat panels would be 20 cm wide
    width, depth = np.ptp(x[:, 0]), np.ptp(x[:, 2])
    assert 0.09 < depth < 0.15
    assert 0.10 < width < 0.17
    np.testing.assert_array_equal(shape()[0], x)


@pytest.mark.parametrize("units", [1.0, 1e5])
def test_a_wrong_unit_is_told_by_the_edge(units: float) -> None:
    with pytest.raises(UserError, match="units_in_meter") as caught:
        read_pattern(changed(["properties", "units_in_meter"], units), "coat.json", 10**6)
    assert caught.value.key.startswith("panels.left_front.edges[")


def test_parts_are_the_panels() -> None:
    raw = read_pattern(tube(), "tube.json", 10**6)
    assert raw.part_names == (("front",), ("back",))
    assert np.ptp(raw.position[:, 1]) == pytest.approx(30.0, rel=0.02)


def test_too_many_triangles_are_told() -> None:
    with pytest.raises(UserError, match="over 100 faces"):
        read_pattern(json.dumps(small_coat()).encode(), "coat.json", 100)
