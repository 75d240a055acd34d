"""The study of garment files knows what it made, and finds what is read wrongly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.files.__main__ import table
from benchmarks.files.cases import CASES, Trial, compressed, of_usd, quads_in_decimetres, vest
from benchmarks.files.garments import Cut, Made, make
from benchmarks.files.judged import Result, carried_out, unlike
from benchmarks.files.surface import kept, zero_level
from benchmarks.files.written import as_quads
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.edges import boundary_loops
from drake_dress.models.garment.label import with_openings
from drake_dress.models.garment.load import WholeGarment
from drake_dress.models.garment.manifold import check_manifold
from drake_dress.models.garment.mesh import face_areas, loop_length

COAT = make(Cut())


def sphere(points: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(points - 0.01, axis=1) - 0.3)


def test_the_level_of_a_distance_is_a_closed_manifold_of_its_area_and_faces_outward() -> None:
    low = np.full(3, -0.4)
    x, faces = zero_level(sphere, low, -low, 0.03)
    check_manifold(faces, len(x))
    assert boundary_loops(faces) == []
    assert face_areas(x, faces).sum() == pytest.approx(4.0 * np.pi * 0.09, rel=0.02)
    volume = np.einsum("fi,fi->f", x[faces[:, 0]], np.cross(x[faces[:, 1]], x[faces[:, 2]])).sum()
    assert volume / 6.0 == pytest.approx(4.0 / 3.0 * np.pi * 0.027, rel=0.03)


def test_a_cut_leaves_the_part_and_a_round_border() -> None:
    low = np.full(3, -0.4)
    x, faces = kept(*(surface := zero_level(sphere, low, -low, 0.03)), surface[0][:, 2] - 0.11)
    (border,) = boundary_loops(faces)
    assert loop_length(x, border) == pytest.approx(2.0 * np.pi * np.sqrt(0.09 - 0.01), rel=0.02)
    assert face_areas(x, faces).sum() == pytest.approx(2.0 * np.pi * 0.3 * 0.2, rel=0.02)


def test_quads_hold_the_same_triangles() -> None:
    polygons = as_quads(COAT.faces)
    assert sum(len(polygon) - 2 for polygon in polygons) == len(COAT.faces)
    assert sum(len(polygon) == 4 for polygon in polygons) > 0.3 * len(polygons)
    assert {edge for p in polygons for edge in zip(p, np.roll(p, -1), strict=True)} <= {
        (a, b) for f in COAT.faces.tolist() for a, b in zip(f, np.roll(f, -1), strict=True)
    }


def whole(made: Made) -> WholeGarment:
    loops = with_openings(made.x, made.faces, {}, "z", None, "coat")
    return WholeGarment("coat", made.x, made.faces, loops, {})


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda x: x, ""),
        (lambda x: x * [1.0, -1.0, 1.0], "from its place"),
        (lambda x: x * 1.05, "from its place"),
        (lambda x: x + [0.0, 0.0, 3.0], ""),
    ],
)
def test_mirrored_and_scaled_garments_are_told_from_the_true_one(change: object, told: str) -> None:
    read = replace(whole(COAT), position=change(COAT.x))  # type: ignore[operator]
    assert told in unlike(read, COAT)
    assert bool(told) == bool(unlike(read, COAT))


def test_exchanged_openings_are_told() -> None:
    read = whole(COAT)
    loops = dict(read.loops) | {"left_cuff": read.loops["left_armhole"]}
    assert "left cuff" in unlike(replace(read, loops=loops), COAT)
    assert unlike(read, replace(COAT, front="closed")) == "opens front, not closed"


@pytest.mark.parametrize("case", [quads_in_decimetres, vest, compressed, of_usd])
def test_files_become_what_they_have_to(case: object, tmp_path: Path) -> None:
    result = carried_out(case, 0, tmp_path)  # type: ignore[arg-type]
    assert result.wrong == ""


def test_what_is_read_in_place_of_a_refusal_is_silently_wrong(tmp_path: Path) -> None:
    def none(rng: np.random.Generator, folder: Path) -> Trial:
        return replace(quads_in_decimetres(rng, folder), made=None, refusal="trousers")

    result = carried_out(none, 0, tmp_path)
    assert result.silent
    assert result.wrong


def test_the_table_counts_by_kind() -> None:
    names = [case.__name__ for case in CASES]
    assert len(set(names)) == len(names) >= 20
    rows = table([Result("vest", 0, "", False, 1.0), Result("vest", 1, "is read", True, 2.0)]).rows
    assert rows == [["A vest: the same garment without sleeves", 2, 1, 1, 2.0]]
