from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from drake_dress.errors import UserError
from drake_dress.models.arrays import IntArray
from drake_dress.models.garment.coat import COATS, CoatParameters, make_coat
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.mesh import GarmentMesh, edge_lengths, loop_length

SPACINGS = (0.01, 0.02, 0.03, 0.045, 0.06)
MODELS = {"default": CoatParameters(), **{name: COATS[name] for name in ("overcoat", "jacket")}}


def smallest_angle(mesh: GarmentMesh) -> float:
    triangles = mesh.rest_position[mesh.faces]
    return np.rad2deg(trimesh.triangles.angles(triangles).min())


def bust(mesh: GarmentMesh, side_nodes: IntArray) -> float:
    """The girth of the cut just below the armholes, closed over the open front."""
    level = mesh.rest_position[side_nodes, 2].min() - 0.02
    body = np.flatnonzero((mesh.region[mesh.faces] == 0).all(axis=1))
    surface = trimesh.Trimesh(mesh.rest_position, mesh.faces[body], process=False)
    segments = trimesh.intersections.mesh_plane(surface, [0, 0, 1.0], [0, 0, level])
    ends = segments.reshape(-1, 3)
    lateral = np.sort(ends[ends[:, 0] > 0, 1])
    gap = lateral[lateral > 0][0] - lateral[lateral < 0][-1]
    return np.linalg.norm(segments[:, 0] - segments[:, 1], axis=1).sum() + gap


def check_sound(mesh: GarmentMesh, spacing: float) -> None:
    mesh.validate()
    length = edge_lengths(mesh.rest_position, mesh.faces)
    assert 0.75 * spacing < length.mean() < 1.25 * spacing
    assert length.max() <= 1.6 * spacing
    assert smallest_angle(mesh) >= 15.0
    loops = [set(q.tolist()) for q in boundary_loops(mesh.faces)]
    assert len(loops) == 3
    cuffs = [set(mesh.loops[f"{side}_cuff"].tolist()) for side in ("left", "right")]
    assert all(cuff in loops for cuff in cuffs)
    border = set().union(*loops)
    for side in ("left", "right"):
        assert not border & set(mesh.loops[f"{side}_armhole"].tolist())


def check_measures(mesh: GarmentMesh, p: CoatParameters) -> None:
    x = mesh.rest_position
    tips = {}
    for side in ("left", "right"):
        armhole, cuff = mesh.loops[f"{side}_armhole"], mesh.loops[f"{side}_cuff"]
        assert loop_length(x, armhole) == pytest.approx(p.armhole_girth, rel=0.02)
        assert loop_length(x, cuff) == pytest.approx(p.cuff_girth, rel=0.03)
        top = x[armhole[np.argmax(x[armhole, 2])]]
        tips[side] = top
        nearest = np.linalg.norm(x[cuff] - top, axis=1).min()
        assert nearest == pytest.approx(p.sleeve_length, rel=0.03)
    assert np.linalg.norm(tips["left"] - tips["right"]) == pytest.approx(p.shoulder_width, rel=0.03)
    assert np.allclose(tips["left"] + tips["right"], 0.0, atol=1e-9)
    assert tips["left"][2] - x[:, 2].min() == pytest.approx(p.body_length, rel=0.03)
    sides = np.concatenate([mesh.loops["left_armhole"], mesh.loops["right_armhole"]])
    assert bust(mesh, sides) == pytest.approx(p.chest, rel=0.03)


@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("name", MODELS)
def test_coat_is_sound_and_meets_its_measures_at_every_spacing(name: str, spacing: float) -> None:
    mesh = make_coat(MODELS[name], spacing)
    check_sound(mesh, spacing)
    check_measures(mesh, MODELS[name])


@settings(max_examples=12, derandomize=True)
@given(data=st.data())
def test_any_coat_is_sound_and_meets_its_measures(data: st.DataObject) -> None:
    def draw(low: float, high: float) -> float:
        return data.draw(st.floats(low, high))

    p = CoatParameters(
        body_length=draw(0.6, 1.05),
        chest=draw(1.0, 1.32),
        shoulder_width=draw(0.42, 0.51),
        sleeve_length=draw(0.5, 0.66),
        armhole_girth=draw(0.48, 0.64),
        cuff_girth=draw(0.28, 0.4),
        collar_height=draw(0.03, 0.09),
    )
    spacing = draw(0.015, 0.06)
    mesh = make_coat(p, spacing)
    check_sound(mesh, spacing)
    check_measures(mesh, p)


def test_coat_is_its_own_mirror_image() -> None:
    mesh = make_coat(CoatParameters(), 0.03)
    x = mesh.rest_position
    mirrored = x * [1.0, -1.0, 1.0]
    distance, image = cKDTree(x).query(mirrored)
    assert distance.max() < 1e-12
    ours = {frozenset(f) for f in mesh.faces.tolist()}
    assert {frozenset(f) for f in image[mesh.faces].tolist()} == ours
    for part in ("armhole", "cuff"):
        left, right = mesh.loops[f"left_{part}"], mesh.loops[f"right_{part}"]
        assert np.array_equal(image[left], right)
        assert x[left, 1].min() > 0.0
    assert set(image[mesh.grasp["left"]]) == set(mesh.grasp["right"].tolist())


def test_normals_point_outward() -> None:
    mesh = make_coat(CoatParameters(), 0.03)
    t = mesh.rest_position[mesh.faces]
    normal = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
    center = t.mean(axis=1)
    body = (mesh.region[mesh.faces] == 0).all(axis=1) & (center[:, 2] < -0.3)
    assert ((normal * center)[body, :2].sum(axis=1) > 0).all()
    for side, code in (("left", 1), ("right", 2)):
        start = mesh.rest_position[mesh.loops[f"{side}_armhole"]].mean(axis=0)
        end = mesh.rest_position[mesh.loops[f"{side}_cuff"]].mean(axis=0)
        along = np.clip((center - start) @ (end - start) / np.sum((end - start) ** 2), 0, 1)
        radial = center - start - along[:, None] * (end - start)
        sleeve = (mesh.region[mesh.faces] == code).all(axis=1)
        assert ((normal * radial)[sleeve].sum(axis=1) > 0).all()


def test_node_count_is_what_plant_and_controller_plan_for() -> None:
    assert 3000 <= len(make_coat(CoatParameters(), 0.02).rest_position) <= 4500
    assert 1500 <= len(make_coat(CoatParameters(), 0.028).rest_position) <= 2200


def test_regions_and_grasp_lie_where_their_names_say() -> None:
    p = CoatParameters()
    mesh = make_coat(p, 0.02)
    x = mesh.rest_position
    assert x[mesh.region == 1, 1].min() > 0 > x[mesh.region == 2, 1].max()
    assert x[mesh.region == 3, 2].max() == x[:, 2].max()
    for side, sign in (("left", 1), ("right", -1)):
        held = x[mesh.grasp[side]]
        assert len(held) >= 4
        assert np.linalg.norm(held - held.mean(axis=0), axis=1).max() < 1.2 * p.grasp_radius
        across = p.neck_width / 2 + p.grasp_fraction * (p.shoulder_width - p.neck_width) / 2
        assert np.allclose(
            held.mean(axis=0), [0, sign * across, 0.25 * p.shoulder_slope], atol=0.02
        )


def test_presets_differ_clearly() -> None:
    overcoat, jacket = (COATS[name] for name in ("overcoat", "jacket"))
    assert overcoat.body_length > 1.3 * jacket.body_length
    assert overcoat.armhole_girth > 1.1 * jacket.armhole_girth


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"body_length": 0.1}, "body_length"),
        ({"chest": 5.0}, "chest"),
        ({"sleeve_length": -0.5}, "sleeve_length"),
        ({"armhole_girth": np.nan}, "armhole_girth"),
        ({"cuff_girth": 0.58}, "cuff_girth"),  # wider than the armhole
        ({"shoulder_width": 0.28, "neck_width": 0.2}, "shoulder_width"),
        ({"shoulder_width": 0.69}, "shoulder_width"),  # for that chest
        ({"armhole_girth": 0.85, "cuff_girth": 0.4, "body_length": 0.4}, "armhole_girth"),
        ({"collar_height": 0.0}, "collar_height"),
        ({"grasp_fraction": 1.5}, "grasp_fraction"),
        ({"grasp_radius": 0.5}, "grasp_radius"),
        ({"chest": "wide"}, "chest"),
    ],
)
def test_bad_measure_is_named(change: dict[str, Any], key: str) -> None:
    with pytest.raises(UserError) as caught:
        make_coat(replace(CoatParameters(), **change), 0.03, source="coat.yaml")
    assert caught.value.key == key
    assert str(caught.value).startswith("coat.yaml: ")
    assert "expected" in str(caught.value) or "cannot be met" in str(caught.value)


@pytest.mark.parametrize("spacing", [0.0, 0.009, 0.07, np.nan, 1.0])
def test_bad_spacing_is_named(spacing: float) -> None:
    with pytest.raises(UserError, match="spacing"):
        make_coat(CoatParameters(), spacing)


@pytest.mark.parametrize("factor", [0.9, 1.12])
def test_a_coat_like_another_has_its_nodes_and_its_own_measures(factor: float) -> None:
    nominal = COATS["jacket"]
    own = replace(
        nominal,
        chest=factor * nominal.chest,
        sleeve_length=factor * nominal.sleeve_length,
        cuff_girth=factor * nominal.cuff_girth,
    )
    first, second = make_coat(nominal, 0.05), make_coat(own, 0.05, like=nominal)
    assert len(make_coat(own, 0.05).rest_position) != len(first.rest_position)
    second.validate()
    check_measures(second, own)
    np.testing.assert_array_equal(second.region, first.region)
    for name, loop in first.loops.items():
        np.testing.assert_array_equal(second.loops[name], loop)
    # each node at the same place of the pattern: moved by no more than the sizes differ
    moved = np.linalg.norm(second.rest_position - first.rest_position, axis=1)
    assert moved.max() < 1.2 * abs(factor - 1.0) * nominal.chest


def test_a_coat_like_itself_is_itself() -> None:
    first, second = (
        make_coat(COATS["jacket"], 0.03),
        make_coat(COATS["jacket"], 0.03, like=COATS["jacket"]),
    )
    np.testing.assert_array_equal(first.rest_position, second.rest_position)
    np.testing.assert_array_equal(first.faces, second.faces)
