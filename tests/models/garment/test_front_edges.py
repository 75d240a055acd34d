"""Front edges that lie on each other are never sewn silently."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from drake_dress.errors import UserError
from drake_dress.models.garment.axes import orientation
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.load import WholeGarment, read_garment
from drake_dress.models.garment.mesh import face_areas
from drake_dress.models.garment.mesh_options import MeshOptions
from tests.models.garment.changed import (
    JACKET,
    Surface,
    of,
    panels,
    pullover,
    written,
    zipped,
)

APART = "the edges of the front coincide"


def read(path: Path, surface: Surface, **options: object) -> WholeGarment:
    return read_garment(written(path, surface), MeshOptions(**options))  # type: ignore[arg-type]


def parts_of(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Returns (F,) which faces are in front, and which are at the left."""
    middle = surface[0][surface[1]].mean(axis=1)
    return middle[:, 0] > 0.03, middle[:, 1] > 0.0


@pytest.mark.parametrize("weld", [0.0, 1e-3])
@pytest.mark.parametrize("spacing", [0.025, 0.04])
def test_a_closed_zip_stays_open_and_is_told(tmp_path: Path, spacing: float, weld: float) -> None:
    x, faces = zipped(spacing)
    plain = read(tmp_path / "c.obj", (x, faces), front="closed")
    whole = read(tmp_path / "c.obj", (x, faces), weld=weld)
    assert plain.front == "closed"
    assert not plain.notes
    assert whole.front == "front"
    (note,) = whole.notes
    assert APART in note
    assert "garment.mesh.front: closed" in note
    # nothing but the front line differs
    assert len(whole.position) == len(x)
    assert len(boundary_loops(whole.faces)) == 3
    areas = face_areas(whole.position, whole.faces), face_areas(plain.position, plain.faces)
    assert np.allclose(*areas)
    assert all(np.array_equal(whole.loops[name], plain.loops[name]) for name in plain.loops)
    mesh = whole.at_spacing(0.05)
    mesh.validate()


def test_edges_with_a_gap_that_weld_would_close_stay_apart(tmp_path: Path) -> None:
    x, faces = zipped()
    border = np.unique(np.concatenate(boundary_loops(faces)))
    front = border[(x[border, 1] == 0.0) & (x[border, 0] > 0.05)]
    left = np.zeros(len(x), dtype=bool)
    left[faces[x[faces].mean(axis=1)[:, 1] > 0.0]] = True
    x[front[left[front]], 1] += 0.002
    whole = read(tmp_path / "c.obj", (x, faces), weld=0.005)
    assert whole.front == "front"
    assert APART in whole.notes[0]
    assert read(tmp_path / "c.obj", (x, faces), weld=0.005, front="closed").front == "closed"


def test_the_place_is_told_in_the_files_axes(tmp_path: Path) -> None:
    surface, axes = zipped(), orientation("-y")
    path = written(tmp_path / "c.obj", surface, axes)
    (note,) = read_garment(path, MeshOptions(up="-y")).notes
    found = re.findall(r"\((-?\d+\.\d+), (-?\d+\.\d+), (-?\d+\.\d+)\)", note)
    neck, hem = (axes @ np.array([float(word) for word in words]) for words in found)
    line = surface[0][(surface[0][:, 1] == 0.0) & (surface[0][:, 0] > 0.05)]
    assert np.allclose(neck, line[np.argmax(line[:, 2])], atol=0.006)
    assert np.allclose(hem, line[np.argmin(line[:, 2])], atol=0.006)


def test_a_pullover_is_closed_without_a_word(tmp_path: Path) -> None:
    whole = read(tmp_path / "p.obj", pullover())
    assert whole.front == "closed"
    assert not whole.notes
    with pytest.raises(UserError, match="front: is open, but neck and hem are different openings"):
        read(tmp_path / "p.obj", pullover(), front="open")
    assert read(tmp_path / "c.obj", of(JACKET), front="open").front == "front"


@pytest.mark.parametrize(
    ("by_panel", "expected"),
    [
        (lambda ahead, left: 1 * ahead, "closed"),
        (lambda ahead, left: ahead + 2 * (left & ~ahead), "closed"),
        (lambda ahead, left: ahead + 2 * left, "front"),
    ],
    ids=["sides", "sides and back", "sides, back and front"],
)
def test_seams_between_panels_are_sewn_but_for_one_down_the_front(
    tmp_path: Path, by_panel: Callable[[np.ndarray, np.ndarray], np.ndarray], expected: str
) -> None:
    surface = pullover()
    whole = read(tmp_path / "p.obj", panels(surface, by_panel(*parts_of(surface))))
    assert whole.front == expected
    assert len(whole.notes) == (expected != "closed")
    back = whole.position[whole.position[:, 0] < 0.0].round(6)
    assert len(np.unique(back, axis=0)) == len(back), "the seams of the back are sewn"


def test_a_closure_at_the_back_stays_open_if_it_is_the_only_seam(tmp_path: Path) -> None:
    x, faces = zipped()
    whole = read(tmp_path / "g.obj", (x * [-1.0, -1.0, 1.0], faces))
    assert whole.front == "back"
    assert "the edges of the back coincide" in whole.notes[0]


def test_an_stl_file_does_not_tell_seams(tmp_path: Path) -> None:
    x, faces = zipped()
    path = tmp_path / "c.stl"
    trimesh.Trimesh(x, faces, process=False).export(path)
    whole = read_garment(path, MeshOptions())
    assert whole.front == "closed"
    assert not whole.notes
