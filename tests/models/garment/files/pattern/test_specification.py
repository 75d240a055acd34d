"""What a pattern's file must say; errors name panel, edge and stitch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.garment.files.pattern.specification import parse_pattern
from tests.models.garment.files.pattern.small_coat import changed, small_coat

_LEFT = ["pattern", "panels", "left_front"]
_STITCH = ["pattern", "stitches", 4]


def test_panels_stand_where_their_placement_says() -> None:
    pattern = parse_pattern(changed([*_LEFT, "rotation"], [0, 90, 0]), "coat.json")
    names = [panel.name for panel in pattern.panels]
    assert names == list(small_coat()["pattern"]["panels"])
    left = pattern.panels[0]
    # a turn about y takes x to −z; units are centimetres
    np.testing.assert_allclose(
        left.placed(np.array([[0.1, 0.2]])), [[0.0, 0.95, 0.11 - 0.1]], atol=1e-12
    )
    turned = parse_pattern(changed([*_LEFT, "rotation"], [90, 0, 90]), "coat.json").panels[0]
    # about x first, then about z: y goes to z, and x to y
    np.testing.assert_allclose(turned.rotation @ [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(turned.rotation @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-12)


def test_units_scale_everything() -> None:
    pattern = parse_pattern(changed(["properties", "units_in_meter"], 1000), "coat.json")
    assert pattern.panels[0].curves[0].length == pytest.approx(0.021)
    assert pattern.panels[0].translation[1] == pytest.approx(0.075)


@pytest.mark.parametrize(
    ("path", "value", "key", "words"),
    [
        (["pattern"], [], "pattern", "missing"),
        (["pattern", "panels"], {}, "pattern.panels", "empty"),
        (["pattern", "stitches"], 3, "pattern.stitches", "list"),
        (["properties", "units_in_meter"], 0, "properties.units_in_meter", "100 for cm"),
        (["properties", "curvature_coords"], "polar", "properties.curvature_coords", "relative"),
        (_LEFT, [], "panels.left_front", "vertices"),
        ([*_LEFT, "vertices", 2], [1, "a"], "panels.left_front.vertices", "2 finite numbers"),
        ([*_LEFT, "translation"], [1, 2], "panels.left_front.translation", "3 finite numbers"),
        ([*_LEFT, "edges"], [], "panels.left_front.edges", "two or more"),
        (
            [*_LEFT, "edges", 1, "endpoints"],
            [1, 9],
            "panels.left_front.edges[1].endpoints",
            "0 to 5",
        ),
        ([*_LEFT, "edges", 1, "endpoints"], [1, 3], "panels.left_front.edges[2]", "one loop"),
        (
            [*_LEFT, "edges", 2, "curvature"],
            {"type": "spline", "params": []},
            "panels.left_front.edges[2].curvature",
            "circle",
        ),
        (
            [*_LEFT, "edges", 2, "curvature"],
            {"type": "cubic", "params": [[0, 1]]},
            "panels.left_front.edges[2].curvature",
            "2 control points",
        ),
        (
            [*_LEFT, "edges", 2, "curvature"],
            {"type": "circle", "params": [3.0, 0, 0]},
            "panels.left_front.edges[2].curvature",
            "at least 10.4",
        ),
        ([*_STITCH, 1, "panel"], "hood", "stitches[4]", "left_sleeve_f"),
        ([*_STITCH, 1, "edge"], 7, "stitches[4]", "0 to 3"),
        ([*_STITCH, 1, "edge"], 2, "stitches[8]", "stitch 4 sews already"),
        (_STITCH, [], "stitches[4]", "two edges"),
    ],
)
def test_a_bad_part_is_told_by_its_name(path: list[Any], value: Any, key: str, words: str) -> None:
    with pytest.raises(UserError, match=words) as caught:
        parse_pattern(changed(path, value), "coat.json")
    assert caught.value.key == key
    assert caught.value.source == "coat.json"


@pytest.mark.parametrize("data", [b"", b"{", b"[1]", b"\xff\xfe", b'{"pattern": 1}'])
def test_what_is_no_pattern_is_told(data: bytes) -> None:
    with pytest.raises(UserError, match="expected"):
        parse_pattern(data, "coat.json")
