"""Every cut is a sound coat at any spacing and size, and differs in shape from the others."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from drake_dress.errors import UserError
from drake_dress.models.garment.coat import COATS, CoatParameters, make_coat
from drake_dress.models.garment.mesh import GarmentMesh, loop_length
from tests.models.garment.coat.soundness import check_whole_coat

FACTOR = st.floats(0.94, 1.06)


@pytest.mark.parametrize("spacing", [0.01, 0.02, 0.03, 0.045, 0.06])
@pytest.mark.parametrize("name", sorted(COATS))
def test_every_cut_is_sound_at_every_spacing(name: str, spacing: float) -> None:
    check_whole_coat(make_coat(COATS[name], spacing), COATS[name], spacing)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(data=st.data())
def test_every_cut_is_sound_with_other_measures(data: st.DataObject) -> None:
    p = COATS[data.draw(st.sampled_from(sorted(COATS)))]
    scale = data.draw(st.floats(0.8, 1.2))
    drawn = {name: value * scale * data.draw(FACTOR) for name, value in p.lengths.items()}
    p = p.with_lengths(drawn)
    spacing = data.draw(st.floats(0.02, 0.06))
    try:
        mesh = make_coat(p, spacing)
    except UserError as error:
        # measures that contradict each other are told by name
        assert error.key in {*drawn, "grasp_radius"}
        return
    check_whole_coat(mesh, p, spacing)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(data=st.data())
def test_every_feature_fits_every_other_one(data: st.DataObject) -> None:
    """Hems, necks, collars, vents and sleeves combine freely."""

    def maybe(low: float, high: float) -> float | None:
        return data.draw(st.none() | st.floats(low, high))

    collar = data.draw(st.sampled_from(["stand", "none", "lapel", "shawl", "hood"]))
    p = CoatParameters(
        body_length=0.95,
        hem_girth=maybe(1.0, 1.6),
        hem_opening=maybe(0.05, 0.35),
        elbow_girth=maybe(0.38, 0.47),
        neck_depth=None if collar in ("lapel", "shawl") else maybe(0.05, 0.1),
        nape_depth=maybe(0.0, 0.08),
        lapel_width=maybe(0.05, 0.1),
        lapel_depth=maybe(0.25, 0.5),
        vent_length=maybe(0.1, 0.4),
        sleeve_slope_deg=maybe(38.0, 65.0),
        collar=collar,
        opens=data.draw(st.sampled_from(["front", "back"])),
    )
    spacing = data.draw(st.floats(0.02, 0.06))
    check_whole_coat(make_coat(p, spacing), p, spacing)


def girth_at(mesh: GarmentMesh, side: str, share: float) -> float:
    """Girth of a sleeve at a share of its length."""
    armhole, cuff = mesh.loops[f"{side}_armhole"], mesh.loops[f"{side}_cuff"]
    sleeve = np.flatnonzero(mesh.region == (1 if side == "left" else 2))
    rows = np.vstack([armhole, sleeve.reshape(-1, len(cuff))])
    return loop_length(mesh.rest_position, rows[round(share * (len(rows) - 1))])


def test_measures_of_shape_are_met() -> None:
    p = replace(CoatParameters(), hem_girth=1.4, hem_opening=0.3, elbow_girth=0.43, vent_length=0.2)
    mesh = make_coat(p, 0.02)
    x = mesh.rest_position
    hem = x[np.isclose(x[:, 2], -p.body_length)]
    half = hem[hem[:, 1] > 1e-9]
    half = half[np.argsort(np.arctan2(half[:, 1], half[:, 0]))]
    length = np.linalg.norm(np.diff(half, axis=0), axis=1).sum()
    assert 2.0 * (length + half[0, 1] + half[-1, 1]) == pytest.approx(1.4, rel=0.01)
    assert 2.0 * half[0, 1] == pytest.approx(0.3, rel=0.02)
    assert girth_at(mesh, "left", 0.5) == pytest.approx(0.43, rel=0.02)
    assert girth_at(make_coat(replace(p, elbow_girth=None), 0.02), "left", 0.5) < 0.40
    closed = x[(x[:, 1] == 0.0) & (x[:, 0] < 0) & (mesh.region == 0)]
    assert closed[:, 2].min() == pytest.approx(0.2 - p.body_length, abs=0.02)


def test_necklines_and_sleeves_follow_their_measures() -> None:
    plain = make_coat(CoatParameters(collar="none"), 0.02)
    crew = make_coat(CoatParameters(collar="none", neck_depth=0.08, nape_depth=0.05), 0.02)
    x = crew.rest_position
    front = x[(x[:, 0] > 0.03) & (np.abs(x[:, 1]) < 0.0651)]
    assert front[:, 2].max() == pytest.approx(0.04 - 0.08, abs=0.01)
    nape = x[(x[:, 1] == 0.0) & (x[:, 0] < 0)][:, 2].max()
    assert nape == pytest.approx(0.04 - 0.05, abs=1e-9)
    level = make_coat(CoatParameters(sleeve_slope_deg=30.0), 0.02)

    def drop(mesh: GarmentMesh) -> float:
        loops = mesh.loops
        x = mesh.rest_position
        return float(x[loops["left_armhole"][0], 2] - x[loops["left_cuff"][0], 2])

    assert drop(level) == pytest.approx(0.56 * np.sin(np.deg2rad(30.0)), rel=1e-6)
    assert drop(plain) == pytest.approx(0.56 * np.sin(np.deg2rad(58.0)), rel=1e-6)


def test_a_coat_that_opens_behind_is_the_mirror_image_of_one_that_opens_in_front() -> None:
    front = make_coat(CoatParameters(), 0.03)
    back = make_coat(CoatParameters(opens="back"), 0.03)
    np.testing.assert_allclose(back.rest_position, front.rest_position * [-1, 1, 1])
    for side in ("left", "right"):
        for part in ("armhole", "cuff"):
            assert set(back.loops[f"{side}_{part}"]) == set(front.loops[f"{side}_{part}"])
        assert set(back.grasp[side]) == set(front.grasp[side])
    # the loops of both run around the arm in the same sense
    areas = []
    for mesh in (front, back):
        ring = mesh.rest_position[mesh.loops["left_armhole"]]
        areas.append(np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)[1])
    assert areas[0] * areas[1] > 0


@pytest.mark.parametrize("name", sorted(COATS))
def test_every_cut_is_its_own_mirror_image(name: str) -> None:
    mesh = make_coat(COATS[name], 0.03)
    distance, image = cKDTree(mesh.rest_position).query(mesh.rest_position * [1.0, -1.0, 1.0])
    assert distance.max() < 1e-12
    ours = {frozenset(f) for f in mesh.faces.tolist()}
    assert {frozenset(f) for f in image[mesh.faces].tolist()} == ours
    # what is sewn to the neck is whole in the middle of the back
    collar = mesh.rest_position[mesh.region == 3]
    assert len(collar) == 0 or (collar[:, 1] == 0.0).any()


def test_cuts_differ_in_more_than_their_size() -> None:
    """Scaled to the same size, their surfaces lie apart."""
    points = {name: make_coat(COATS[name], 0.03).rest_position for name in sorted(COATS)}
    for one, other in combinations(points, 2):
        x, y = points[one], points[other]
        y = y * np.ptp(x[:, 2]) / np.ptp(y[:, 2])
        apart = max(cKDTree(y).query(x)[0].max(), cKDTree(x).query(y)[0].max())
        assert apart > 0.04, (one, other)


@pytest.mark.parametrize("name", sorted(COATS))
def test_a_cut_like_another_size_has_its_nodes(name: str) -> None:
    p = COATS[name]
    own = p.with_lengths({key: 1.05 * value for key, value in p.lengths.items()})
    first, second = make_coat(p, 0.04), make_coat(own, 0.04, like=p)
    second.validate()
    np.testing.assert_array_equal(first.region, second.region)
    assert np.linalg.norm(second.rest_position - first.rest_position, axis=1).max() < 0.08
    if p.vent_length is not None:
        assert own.vent_length != p.vent_length


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"hem_girth": 2.0}, "hem_girth"),
        ({"hem_opening": 0.7}, "hem_opening"),
        ({"elbow_girth": 0.7}, "elbow_girth"),
        ({"neck_depth": 0.5}, "neck_depth"),
        ({"neck_depth": 0.19, "armhole_girth": 0.42, "cuff_girth": 0.3}, "neck_depth"),
        ({"neck_depth": 0.08, "collar": "shawl"}, "neck_depth"),
        ({"neck_depth": 0.12, "collar": "hood"}, "neck_depth"),
        ({"lapel_depth": 0.7}, "lapel_depth"),
        ({"vent_length": 0.6}, "vent_length"),
        ({"sleeve_slope_deg": 90.0}, "sleeve_slope_deg"),
        ({"collar": "ruff"}, "collar"),
        ({"opens": "side"}, "opens"),
        ({"hood_height": True}, "hood_height"),
    ],
)
def test_bad_shape_is_named_with_what_is_expected(change: dict[str, object], key: str) -> None:
    with pytest.raises(UserError, match="expected") as caught:
        make_coat(replace(CoatParameters(), **change), 0.03, source="coat.yaml")  # type: ignore[arg-type]
    assert caught.value.key == key
