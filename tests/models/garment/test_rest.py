"""A draped mesh with its pattern as texture coordinates rests in the size of the pattern."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.elastic_energy import elastic_energy
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.garment.files.pattern.sewing import sewn
from drake_dress.models.garment.files.pattern.specification import parse_pattern
from drake_dress.models.garment.files.pattern.worn import worn
from drake_dress.models.garment.load import MeshOptions, WholeGarment, read_garment
from drake_dress.models.garment.mesh import face_areas, loop_length
from drake_dress.models.garment.rest import at_rest
from tests.models.garment.files.pattern.small_coat import small_coat
from tests.models.garment.test_flat import FACES, FLAT, grid, raw, rolled


def draped(flat: FloatArray) -> FloatArray:
    """Returns (n,3) a rolled sheet that is stretched by 0 to 10 % along, more at its far end."""
    length = flat[:, 1].max()
    along = flat[:, 1] + 0.05 * flat[:, 1] ** 2 / length
    return rolled(np.stack([flat[:, 0], along], axis=1))


def test_an_unstrained_sheet_stays_as_it_is() -> None:
    sheet = raw(rolled(FLAT), FLAT[FACES])
    rested, _ = at_rest(sheet, "uv")
    assert np.abs(sides(rested.position) / sides(np.pad(FLAT, ((0, 0), (0, 1)))) - 1).max() < 0.01


def sides(x: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(np.roll(x[FACES], -1, axis=1) - x[FACES], axis=2))


def test_a_draped_developable_sheet_has_no_stretch_energy_flat_and_its_strain_draped() -> None:
    x, flat = draped(FLAT), np.pad(FLAT, ((0, 0), (0, 1)))
    rested, told = at_rest(raw(x, FLAT[FACES]), "uv")
    assert "rests in the size of its texture coordinates, a pattern of 1 pieces" in told[0]
    # the median triangle of the island is stretched by 5 % along, so the pattern is 2.5 % larger
    size = np.sqrt(1.05)
    elements = make_elements(rested.position, FACES)
    energy = [elastic_energy(elements, 2000.0, 0.0, at) for at in (size * flat, x)]
    assert energy[0] < 1e-3 * energy[1]
    exact = make_elements(flat, FACES, size * FLAT[FACES])
    assert energy[1] == pytest.approx(elastic_energy(exact, 2000.0, 0.0, x), rel=0.02)


@pytest.mark.parametrize("rest", ["mesh", "auto", "uv"])
def test_without_a_pattern_the_mesh_rests_as_it_is(rest: str) -> None:
    for uv in (None, FLAT[FACES] * [1.0, 4.0]):
        sheet = raw(draped(FLAT), uv)
        if rest == "uv":
            with pytest.raises(UserError, match="rest"):
                at_rest(sheet, rest)
            continue
        rested, told = at_rest(sheet, rest)
        assert rested is sheet
        assert bool(told) == (rest == "auto")


def test_a_draped_mesh_is_told_and_does_not_change() -> None:
    sheet = raw(draped(FLAT), FLAT[FACES])
    rested, told = at_rest(sheet, "mesh")
    assert rested is sheet
    assert "garment.mesh.rest: uv takes their size" in told[0]
    assert at_rest(raw(rolled(FLAT), FLAT[FACES]), "mesh")[1] == ()


def test_the_unit_of_the_texture_does_not_matter() -> None:
    flat, faces = grid(7, 5)
    ends = [at_rest(raw(draped(flat), k * flat[faces], faces), "uv")[0] for k in (1.0, 1e-3)]
    np.testing.assert_allclose(ends[0].position, ends[1].position, atol=1e-9)


@cache
def coat() -> tuple[FloatArray, IntArray, FloatArray]:
    """Returns a worn coat, its faces, and their corners in the flat panels, m."""
    pattern = sewn(parse_pattern(json.dumps(small_coat()).encode(), "coat.json"), 0.03)
    return worn(pattern, lambda _: None), pattern.faces.astype(np.int32), pattern.corners


def strained(x: FloatArray) -> FloatArray:
    """Returns a coat whose cloth is longer and shorter by up to 12 % in turn, down the body."""
    y = x.copy()
    y[:, 1] += 0.12 / 20.0 * np.sin(20.0 * x[:, 1])
    return y


def write(path: Path, x: FloatArray, faces: IntArray, corners: FloatArray) -> Path:
    """Writes an OBJ whose texture coordinates are the panels side by side, each of its own size."""
    lines = [f"v {a!r} {b!r} {c!r}" for a, b, c in x.tolist()]
    lines += [f"vt {u!r} {v!r}" for u, v in (0.37 * corners.reshape(-1, 2)).tolist()]
    for k, face in enumerate(faces + 1):
        lines.append("f " + " ".join(f"{n}/{3 * k + j + 1}" for j, n in enumerate(face)))
    path.write_text("\n".join(lines) + "\n")
    return path


def lengths(x: FloatArray, faces: IntArray) -> FloatArray:
    """Returns (F,3) the sides of each face, the shortest first."""
    return np.sort(np.linalg.norm(np.roll(x[faces], -1, axis=1) - x[faces], axis=2), axis=1)


def test_a_garment_rests_in_the_size_of_its_panels_at_any_spacing(tmp_path: Path) -> None:
    x, faces, corners = coat()
    path = write(tmp_path / "coat.obj", strained(x), faces, corners)
    wanted = np.sort(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2), axis=1)
    off = []
    for rest in ("mesh", "uv"):
        whole = read_garment(path, MeshOptions(up="y", rest=rest))
        off.append(np.abs(lengths(whole.position, whole.faces) / wanted - 1.0))
    assert np.percentile(off[0], 90) > 0.07
    assert np.percentile(off[1], 90) < 0.02
    assert np.median(off[1]) < 0.01
    for spacing in (0.03, 0.05):
        mesh = whole.at_spacing(spacing)
        areas = [face_areas(*m).sum() for m in ((mesh.rest_position, mesh.faces), whole_of(whole))]
        assert areas[0] == pytest.approx(areas[1], rel=0.02)
        for name, loop in whole.loops.items():
            girth = loop_length(mesh.rest_position, mesh.loops[name])
            assert girth == pytest.approx(loop_length(whole.position, loop), rel=0.04)


def whole_of(whole: WholeGarment) -> tuple[FloatArray, IntArray]:
    return whole.position, whole.faces


def test_the_unit_is_found_before_the_rest_shape(tmp_path: Path) -> None:
    x, faces, corners = coat()
    path = write(tmp_path / "coat.obj", 100.0 * strained(x), faces, corners)
    whole = read_garment(path, MeshOptions(unit="auto", up="y", rest="uv"))
    assert "the unit is cm" in whole.notes[0]
    assert any("rests in the size" in note for note in whole.notes)
