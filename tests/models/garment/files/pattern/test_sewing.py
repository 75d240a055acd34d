"""Seams have the same nodes on both sides, and the sewn garment is one manifold."""

from __future__ import annotations

import json

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.files.pattern.sewing import SewnPattern, sewn
from drake_dress.models.garment.files.pattern.specification import parse_pattern
from drake_dress.models.garment.manifold import check_manifold
from tests.models.garment.files.pattern.small_coat import changed, small_coat


def coat(spacing: float) -> SewnPattern:
    return sewn(parse_pattern(json.dumps(small_coat()).encode(), "coat.json"), spacing)


@pytest.mark.parametrize("spacing", [0.015, 0.03, 0.05])
def test_a_sewn_coat_is_one_oriented_manifold_with_a_rim_and_two_cuffs(spacing: float) -> None:
    s = coat(spacing)
    check_manifold(s.faces, len(s.position))
    loops = boundary_loops(s.faces)
    assert len(loops) == 3
    steps = np.linalg.norm(np.diff(s.corners, axis=1), axis=2)
    assert 0.7 * spacing < steps.mean() < 1.25 * spacing
    cuffs = sorted(loops, key=len)[:2]
    middles = [s.position[cuff].mean(axis=0) for cuff in cuffs]
    assert sorted(np.sign(m[0]) for m in middles) == [-1.0, 1.0]


def test_no_cloth_is_lost_or_made() -> None:
    pattern = parse_pattern(json.dumps(small_coat()).encode(), "coat.json")
    s = coat(0.02)
    a, b, c = (s.corners[:, k] for k in range(3))
    area = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    for number, panel in enumerate(pattern.panels):
        x, y = np.vstack([curve.sampled(50)[:-1] for curve in panel.curves]).T
        whole = abs(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
        assert area[s.panel == number].sum() == pytest.approx(whole, rel=0.005)


def test_the_two_sides_of_a_panel_are_told_apart_by_the_bulge() -> None:
    s = coat(0.02)
    names = list(small_coat()["pattern"]["panels"])
    for front, back in (("left_front", "back"), ("left_sleeve_f", "left_sleeve_b")):
        z = [s.position[s.faces[s.panel == names.index(n)]][..., 2] for n in (front, back)]
        assert z[0].max() > 0.13
        assert z[1].min() < -0.13


def test_edges_sewn_the_same_way_join_their_starts() -> None:
    stitch = small_coat()["pattern"]["stitches"][8]
    same = changed(["pattern", "stitches", 8], [*stitch, "right_wrong"])
    crossed = sewn(parse_pattern(same, "coat.json"), 0.03)
    with pytest.raises(UserError):  # the sleeve is twisted: a surface with one side
        check_manifold(crossed.faces, len(crossed.position))


def test_a_border_that_crosses_itself_is_told_by_its_panel() -> None:
    bow = changed(["pattern", "panels", "back", "vertices", 1], [-60, 20])
    with pytest.raises(UserError, match="does not cross") as caught:
        sewn(parse_pattern(bow, "coat.json"), 0.03)
    assert caught.value.key == "panels.back"
