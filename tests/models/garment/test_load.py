from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.load import load_garment
from drake_dress.models.garment.mesh import GarmentMesh, edge_lengths, loop_length


@pytest.fixture(scope="module")
def coat() -> GarmentMesh:
    return make_coat(CoatParameters(), 0.03)


def write(path: Path, position: FloatArray, faces: IntArray) -> Path:
    trimesh.Trimesh(position, faces, process=False).export(path)
    return path


def write_obj(path: Path, position: FloatArray, faces: IntArray) -> Path:
    lines = [f"v {a} {b} {c}" for a, b, c in position] + [f"f {a} {b} {c}" for a, b, c in faces + 1]
    path.write_text("\n".join(lines) + "\n")
    return path


def named(mesh: GarmentMesh) -> dict[str, list[int]]:
    return {name: loop.tolist() for name, loop in mesh.loops.items()}


@pytest.mark.parametrize("extension", ["obj", "ply", "stl"])
@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("cm", 100.0), ("mm", 1000.0)])
def test_every_format_and_unit_gives_the_same_garment(
    tmp_path: Path, coat: GarmentMesh, extension: str, unit: str, factor: float
) -> None:
    path = write(tmp_path / f"coat.{extension}", factor * coat.rest_position, coat.faces)
    mesh = load_garment(path, unit=unit)
    assert len(mesh.rest_position) == len(coat.rest_position)
    assert np.allclose(
        np.ptp(mesh.rest_position, axis=0), np.ptp(coat.rest_position, axis=0), atol=1e-4
    )
    for side in ("left", "right"):
        cuff = f"{side}_cuff"
        girth = loop_length(coat.rest_position, coat.loops[cuff])
        assert loop_length(mesh.rest_position, mesh.loops[cuff]) == pytest.approx(girth, rel=1e-3)
        armhole = mesh.rest_position[mesh.loops[f"{side}_armhole"]]
        true = coat.rest_position[coat.loops[f"{side}_armhole"]]
        assert np.linalg.norm(armhole.mean(axis=0) - true.mean(axis=0)) < 0.05


def test_scale_beside_the_unit_brings_any_file_to_life_size(
    tmp_path: Path, coat: GarmentMesh
) -> None:
    path = write(tmp_path / "coat.obj", 39.37 * coat.rest_position, coat.faces)
    mesh = load_garment(path, unit="m", scale=1.0 / 39.37)
    size = np.ptp(coat.rest_position, axis=0)
    assert np.allclose(np.ptp(mesh.rest_position, axis=0), size, atol=1e-4)
    mesh = load_garment(path, unit="cm", scale=100.0 / 39.37)
    assert np.allclose(np.ptp(mesh.rest_position, axis=0), size, atol=1e-4)
    message = refusal(path, unit="m")
    assert "scale" in message
    assert "expected 0.0001 to 10000" in refusal(path, unit="m", scale=0.0)


def test_named_loops_and_grasp_are_kept_exactly(tmp_path: Path, coat: GarmentMesh) -> None:
    path = write_obj(tmp_path / "coat.obj", coat.rest_position, coat.faces)
    grasp = {side: nodes.tolist() for side, nodes in coat.grasp.items()}
    mesh = load_garment(path, unit="m", loops=named(coat), grasp=grasp)
    assert np.allclose(mesh.rest_position, coat.rest_position)
    for name, loop in coat.loops.items():
        assert np.array_equal(mesh.loops[name], loop)
    for side, nodes in coat.grasp.items():
        assert np.array_equal(mesh.grasp[side], nodes)
    sleeve = coat.region == 1
    assert np.array_equal(mesh.region == 1, sleeve)


def test_file_in_another_place_lands_between_the_shoulder_tips(
    tmp_path: Path, coat: GarmentMesh
) -> None:
    path = write_obj(tmp_path / "coat.obj", coat.rest_position + [5.0, 1.0, 2.0], coat.faces)
    mesh = load_garment(path, unit="m", loops=named(coat))
    assert np.allclose(mesh.rest_position, coat.rest_position)


def test_faces_that_point_inward_are_turned(tmp_path: Path, coat: GarmentMesh) -> None:
    path = write_obj(tmp_path / "coat.obj", coat.rest_position, coat.faces[:, ::-1])
    mesh = load_garment(path, unit="m", loops=named(coat))
    assert np.array_equal(np.sort(mesh.faces), np.sort(coat.faces))
    a, b, c = (mesh.rest_position[mesh.faces[:, k]] for k in range(3))
    p, q, r = (coat.rest_position[coat.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a) * np.cross(q - p, r - p)).sum(axis=1).min() > 0


@pytest.mark.parametrize("spacing", [0.02, 0.045, 0.06])
def test_spacing_is_met_and_loops_stay(tmp_path: Path, coat: GarmentMesh, spacing: float) -> None:
    path = write_obj(tmp_path / "coat.obj", coat.rest_position, coat.faces)
    mesh = load_garment(path, unit="m", spacing=spacing, loops=named(coat))
    mesh.validate()
    length = edge_lengths(mesh.rest_position, mesh.faces)
    assert 0.7 * spacing < length.mean() < 1.3 * spacing
    assert length.max() < 1.6 * spacing
    assert len(boundary_loops(mesh.faces)) == 3
    for name, loop in coat.loops.items():
        girth = loop_length(coat.rest_position, loop)
        assert loop_length(mesh.rest_position, mesh.loops[name]) == pytest.approx(girth, rel=0.08)


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_found_armhole_is_a_loop_that_parts_the_sleeve(tmp_path: Path, scale: float) -> None:
    coat = make_coat(CoatParameters(), 0.02 * scale)
    mesh = load_garment(write(tmp_path / "c.ply", coat.rest_position, coat.faces), unit="m")
    for side, code in (("left", 1), ("right", 2)):
        loop = mesh.loops[f"{side}_armhole"]
        edges = {frozenset(e) for f in mesh.faces.tolist() for e in pairwise([*f, f[0]])}
        assert all(frozenset(e) in edges for e in pairwise([*loop.tolist(), int(loop[0])]))
        assert np.mean(mesh.region == code) == pytest.approx(np.mean(coat.region == code), rel=0.3)


def refusal(path: Path, **kwargs: Any) -> str:
    with pytest.raises(UserError) as caught:
        load_garment(path, **{"unit": "m", **kwargs})
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    return message


def test_unreadable_file_is_named(tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "none.obj")
    assert "expected .obj, .ply, .stl, .gltf, .glb, .json; export it as glTF" in refusal(
        tmp_path / "coat.fbx"
    )
    for extension in ("obj", "ply", "stl"):
        path = tmp_path / f"empty.{extension}"
        path.write_bytes(b"")
        assert "empty" in refusal(path)
        path.write_bytes(b"\x00\xff nonsense \n" * 20)
        refusal(path)
    path = tmp_path / "points.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    assert "empty" in refusal(path)
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
    refusal(path)
    path = tmp_path / "points.ply"
    trimesh.PointCloud(np.eye(3)).export(path)
    assert "empty" in refusal(path)


def test_unusable_mesh_is_named(tmp_path: Path, coat: GarmentMesh) -> None:
    x, faces = coat.rest_position, coat.faces
    path = tmp_path / "coat.obj"
    broken = x.copy()
    broken[5] = np.nan
    assert "NaN" in refusal(write_obj(path, broken, faces))
    fin = np.vstack([faces, [*faces[100, :2], faces[-1, 2]]])
    assert refusal(write_obj(path, x, fin))
    two = np.vstack([faces, faces + len(x)])
    assert "separate parts" in refusal(write_obj(path, np.vstack([x, x + [0, 0, 0.3]]), two))


def test_wrong_unit_is_named_with_the_one_that_fits(tmp_path: Path, coat: GarmentMesh) -> None:
    path = write_obj(tmp_path / "coat.obj", 100 * coat.rest_position, coat.faces)
    message = refusal(path, unit="m")
    assert "unit" in message
    assert "with cm it would fit" in message
    assert "expected one of m, cm, mm" in refusal(path, unit="inch")


def test_garment_without_findable_loops_is_named(tmp_path: Path, coat: GarmentMesh) -> None:
    sphere = trimesh.creation.icosphere(3, radius=0.4)
    path = write(tmp_path / "sphere.obj", sphere.vertices, sphere.faces)
    assert "the surface is closed" in refusal(path)
    turned = coat.rest_position[:, [1, 0, 2]] * [1, -1, 1]  # faces -y
    assert "are up and facing right" in refusal(
        write_obj(tmp_path / "coat.obj", turned, coat.faces)
    )


def trousers() -> tuple[FloatArray, IntArray]:
    """A waist that parts into two legs along a crotch."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    waist = np.stack([0.12 * np.cos(angle), 0.2 * np.sin(angle)], axis=1)
    nodes = [np.column_stack([waist, np.full(24, z)]) for z in np.linspace(1.05, 0.8, 5)]
    crotch = np.linspace(waist[0], waist[12], 5)[1:-1]
    nodes.append(np.column_stack([crotch, np.full(3, 0.8)]))
    rings = [[np.arange(24) + 24 * k for k in range(5)]]
    last, inner, count = rings[0][-1], 120 + np.arange(3), 123
    halves = np.r_[last[:13], inner[::-1]], np.r_[last[0], inner, last[12:]]
    for sign, half in zip((1.0, -1.0), halves, strict=True):
        around = np.linspace(0.0, sign * 2.0 * np.pi, 16, endpoint=False)
        leg = [half]
        for z in np.linspace(0.8, 0.0, 12)[1:]:
            circle = np.stack([0.09 * np.cos(around), 0.2 * sign + 0.09 * np.sin(around)], axis=1)
            nodes.append(np.column_stack([circle, np.full(16, z)]))
            leg.append(np.arange(16) + count)
            count += 16
        rings.append(leg)
    faces = []
    for tube in rings:
        for upper, lower in pairwise(tube):
            a, b, c, d = upper, np.roll(upper, -1), lower, np.roll(lower, -1)
            faces += [np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)]
    return np.concatenate(nodes), np.concatenate(faces).astype(np.int32)


@pytest.mark.parametrize("up", ["z", "-z", "y"])
def test_trousers_are_told_by_what_they_lack(tmp_path: Path, up: str) -> None:
    path = write_obj(tmp_path / "trousers.obj", *trousers())
    message = refusal(path, up=up)
    assert "it would fit" not in message
    if up != "y":
        assert "are these trousers?" in message


def test_bad_indices_are_named(tmp_path: Path, coat: GarmentMesh) -> None:
    path = write_obj(tmp_path / "coat.obj", coat.rest_position, coat.faces)
    loop = named(coat)["left_cuff"]
    assert "loops.left_cuff" in refusal(path, loops={"left_cuff": [*loop, 10**6]})
    assert "loops.left_cuff" in refusal(path, loops={"left_cuff": [-1, *loop]})
    assert "closed chain" in refusal(path, loops={"left_cuff": loop[::2]})
    assert "whole numbers" in refusal(path, loops={"left_cuff": [0.5, 1.0, 2.0]})
    assert "unknown" in refusal(path, loops={"left_sleeve": loop})
    assert "grasp.left" in refusal(path, grasp={"left": [10**6]})
    assert "unknown" in refusal(path, grasp={"middle": [0]})
    assert "spacing" in refusal(path, spacing=5.0)
