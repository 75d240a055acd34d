"""glTF files are read where the scene places their meshes, or refused before zeros are read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.files import read_mesh
from drake_dress.models.garment.load import load_garment

JACKET = make_coat(COATS["jacket"], 0.06)
X, FACES = JACKET.rest_position, JACKET.faces
UPRIGHT = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # z up to y up
PLACED = trimesh.transformations.compose_matrix(
    angles=(0.3, -0.2, 0.5), translate=(0.1, -0.4, 2.0), scale=(2.0, 2.0, 2.0)
)


def scene_of(*transforms: np.ndarray) -> trimesh.Scene:
    scene = trimesh.Scene()
    for k, transform in enumerate(transforms):
        mesh = trimesh.Trimesh(X @ UPRIGHT.T, FACES, process=False)
        scene.add_geometry(mesh, node_name=f"Part{k}", geom_name=f"Mesh{k}", transform=transform)
    return scene


@pytest.mark.parametrize("extension", ["glb", "gltf"])
def test_a_coat_is_read_as_it_was_written(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"coat.{extension}"
    scene_of(np.eye(4)).export(str(path))
    if extension == "gltf":
        files = trimesh.exchange.gltf.export_gltf(scene_of(np.eye(4)))
        for name, data in files.items():
            (tmp_path / (path.name if name == "model.gltf" else name)).write_bytes(data)
    mesh = load_garment(path, unit="m", up="y")
    np.testing.assert_allclose(np.ptp(mesh.rest_position, axis=0), np.ptp(X, axis=0), atol=1e-5)
    assert len(mesh.faces) == len(FACES)


def test_meshes_are_where_the_scene_places_them_and_named(tmp_path: Path) -> None:
    path = tmp_path / "two.glb"
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    scene_of(PLACED, mirror).export(str(path))
    mesh = read_mesh(path)
    parts = {name: k for k, names in enumerate(mesh.part_names) for name in names}
    for name, transform in (("Part0", PLACED), ("Part1", mirror)):
        faces = mesh.faces[mesh.face_part == parts[name]]
        wanted = X @ UPRIGHT.T @ transform[:3, :3].T + transform[:3, 3]
        nodes = np.unique(faces)
        np.testing.assert_allclose(mesh.position[nodes], wanted, atol=1e-5)
        # a mirrored mesh keeps its outside
        of_file = np.cross(*np.moveaxis(np.diff(mesh.position[faces], axis=1), 1, 0))
        outside = np.cross(*np.moveaxis(np.diff((X @ UPRIGHT.T)[FACES], axis=1), 1, 0))
        turned = outside @ np.linalg.inv(transform[:3, :3])
        assert ((of_file * turned).sum(axis=1) > 0.0).all()


def header_of(tmp_path: Path, change: Any) -> Path:
    files = trimesh.exchange.gltf.export_gltf(scene_of(np.eye(4)))
    header = json.loads(files.pop("model.gltf"))
    change(header)
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    path = tmp_path / "coat.gltf"
    path.write_text(json.dumps(header))
    return path


def position(header: dict[str, Any]) -> dict[str, Any]:
    at = header["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    found: dict[str, Any] = header["accessors"][at]
    return found


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda h: h.update(extensionsRequired=["KHR_draco_mesh_compression"]), "has Draco comp"),
        (lambda h: h.update(extensionsUsed=["EXT_meshopt_compression"]), "has meshopt compression"),
        (lambda h: position(h).update(sparse={"count": 1}), "sparse or absent positions"),
        (lambda h: position(h).pop("bufferView"), "sparse or absent positions"),
        (lambda h: position(h).update(normalized=True), "fractions of float32"),
        (lambda h: h["meshes"][0]["primitives"][0].update(mode=6), "triangle fans"),
        (lambda h: h["meshes"][0]["primitives"][0].pop("attributes"), "no sound glTF file"),
        (lambda h: h["buffers"][0].update(uri="absent.bin"), "no sound glTF file"),
        (lambda h: h.update(meshes=[], nodes=[], scenes=[{"nodes": []}]), "mesh is empty"),
    ],
)
def test_what_would_be_read_as_zeros_is_refused(tmp_path: Path, change: Any, expected: str) -> None:
    path = header_of(tmp_path, change)
    with pytest.raises(UserError, match=expected) as caught:
        read_mesh(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


@settings(max_examples=40)
@given(st.data())
def test_damaged_bytes_are_refused_or_read(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("gltf") / "coat.glb"
    whole = scene_of(np.eye(4)).export(file_type="glb")
    content = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        # the header, or anywhere
        at = data.draw(st.integers(0, 2500) | st.integers(0, len(content) - 1))
        content[at] = data.draw(st.sampled_from(b"0123456789-[]{}xe") | st.integers(0, 255))
    end = data.draw(st.just(len(content)) | st.integers(1, len(content)))
    path.write_bytes(bytes(content[:end]))
    try:
        mesh = read_mesh(path)
    except UserError as error:
        assert str(error).startswith(str(path))
        assert "\n" not in str(error)
        return
    assert np.isfinite(mesh.position).all()
    assert mesh.faces.max() < len(mesh.position)


def test_formats_that_are_not_read_say_how_to_turn_them(tmp_path: Path) -> None:
    for name in ("coat.usdz", "coat.usd", "coat.zprj"):
        with pytest.raises(UserError, match="export it as glTF or OBJ"):
            read_mesh(tmp_path / name)
