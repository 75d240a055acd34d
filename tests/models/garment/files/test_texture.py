"""Texture coordinates belong to the corners of the triangles, in every format that has them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from drake_dress.models.garment.files import read_mesh
from drake_dress.models.garment.files.raw import RawMesh
from drake_dress.models.garment.mend import mended
from tests.models.garment.test_flat import FACES, FLAT, rolled

X = rolled(FLAT)


def corner_pairs(mesh: RawMesh) -> tuple[np.ndarray, np.ndarray]:
    """Returns place and texture coordinates of all corners."""
    assert mesh.uv is not None
    return mesh.position[mesh.faces].reshape(-1, 3), mesh.uv.reshape(-1, 2)


def check_as_written(mesh: RawMesh, flipped: bool = False) -> None:
    place, uv = corner_pairs(mesh)
    node = np.argmin(np.linalg.norm(place[:, None] - X[None], axis=2), axis=1)
    wanted = FLAT[node] * [1.0, -1.0] + [0.0, 1.0] if flipped else FLAT[node]
    np.testing.assert_allclose(uv, wanted, atol=1e-6)


def obj_lines() -> list[str]:
    order = np.arange(len(X))[::-1]  # own numbers, apart from the nodes'
    lines = [f"v {a!r} {b!r} {c!r}" for a, b, c in X.tolist()]
    return lines + [f"vt {u!r} {v!r} 0" for u, v in FLAT[order].tolist()]


@pytest.mark.parametrize("relative", [False, True])
@pytest.mark.parametrize("normal", ["", "/1", "/"])
def test_obj(tmp_path: Path, relative: bool, normal: str) -> None:
    n = len(X)
    lines = [*obj_lines(), "vn 0 0 1"]
    half = len(FACES) // 2
    for first, second in zip(FACES[:half], FACES[half:], strict=True):  # quads
        quad = [first[0], first[1], first[2], second[2]]
        words = [f"{k - n}/{-k - 1}" if relative else f"{k + 1}/{n - k}" for k in quad]
        lines.append("f " + " ".join(word + normal for word in words))
    path = tmp_path / "sheet.obj"
    path.write_text("\n".join(lines))
    check_as_written(read_mesh(path))


def test_obj_without_or_with_some_or_with_damaged_texture_coordinates(tmp_path: Path) -> None:
    path = tmp_path / "sheet.obj"
    words = [[f"{k + 1}" for k in face] for face in FACES]
    path.write_text("\n".join([*obj_lines(), *("f " + " ".join(w) for w in words)]))
    assert read_mesh(path).uv is None
    words[3:] = [[f"{word}/{len(X) - int(word) + 1}" for word in face] for face in words[3:]]
    words[5] = [f"{word}/{10**6}" for word in words[2]]
    path.write_text("\n".join([*obj_lines(), *("f " + " ".join(w) for w in words)]))
    uv = read_mesh(path).uv
    assert uv is not None
    bare = np.flatnonzero(np.isnan(uv).any(axis=(1, 2)))
    assert bare.tolist() == [0, 1, 2, 5]
    lines = obj_lines()
    lines[len(X)] = "vt here there"
    path.write_text("\n".join([*lines, *("f " + " ".join(w) for w in words)]))
    damaged = read_mesh(path).uv
    assert damaged is not None
    assert np.isnan(damaged).any(axis=(1, 2)).sum() > 4


@pytest.mark.parametrize("names", [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
def test_ply(tmp_path: Path, names: tuple[str, str]) -> None:
    head = ["ply", "format ascii 1.0", f"element vertex {len(X)}"]
    head += [f"property double {name}" for name in ("x", "y", "z", *names)]
    head += [f"element face {len(FACES)}", "property list uchar int vertex_indices", "end_header"]
    rows = [" ".join(map(repr, row)) for row in np.hstack([X, FLAT]).tolist()]
    path = tmp_path / "sheet.ply"
    path.write_text("\n".join([*head, *rows, *(f"3 {a} {b} {c}" for a, b, c in FACES)]) + "\n")
    check_as_written(read_mesh(path))


@pytest.mark.parametrize("extension", ["glb", "gltf"])
def test_gltf_without_the_images_of_its_material(tmp_path: Path, extension: str) -> None:
    visual = trimesh.visual.TextureVisuals(uv=FLAT)
    scene = trimesh.Scene(trimesh.Trimesh(X, FACES, process=False, visual=visual))
    path = tmp_path / f"sheet.{extension}"
    if extension == "glb":
        scene.export(str(path))
    else:
        for name, data in trimesh.exchange.gltf.export_gltf(scene).items():
            (tmp_path / (path.name if name == "model.gltf" else name)).write_bytes(data)
    check_as_written(read_mesh(path))


def test_turned_faces_keep_the_texture_of_their_corners() -> None:
    faces, turned = FACES.astype(np.int64).copy(), [3, 17, 90]
    uv = FLAT[faces]
    faces[turned], uv[turned] = faces[turned][:, ::-1], uv[turned][:, ::-1]
    mesh, notes = mended(RawMesh.of("sheet.obj", X, faces, uv=uv))
    assert "wound the other way round" in notes[0]
    check_as_written(mesh)
