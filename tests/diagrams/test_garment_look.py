"""`drake-dress garment` writes a page, figures and a scenario that runs the garment, or nothing."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_dress.__main__ import main
from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.scenario.edges import at_edges
from drake_dress.file_output import GARMENT_FILES
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.mesh import LOOP_NAMES, GarmentMesh
from tests.closed_coat import closed_coat
from tests.present import present

SCENARIOS = Path(__file__).parents[2] / "scenarios"
COAT = make_coat(COATS["jacket"], 0.05)


def write_obj(path: Path, mesh: GarmentMesh, y_up: bool = False) -> None:
    x: FloatArray = mesh.rest_position[:, [1, 2, 0]] if y_up else mesh.rest_position
    lines = [f"v {a:.9f} {b:.9f} {c:.9f}" for a, b, c in x]
    lines += [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")


def figures(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / "garment.json").read_text())
    return found


def one_line(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Returns what an unusable command line is answered with."""
    assert main(words) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    return told.err


def test_a_shipped_scenario_fits_and_its_page_needs_nothing_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["garment", "dummy_standing", "--out", str(out)]) == 0
    told = capsys.readouterr()
    assert told.out == f"it fits\npage, figures and scenario: {out}\n"
    assert sorted(path.name for path in out.iterdir()) == sorted(GARMENT_FILES)
    found = figures(out)
    assert found["fits"] is True
    assert found["reasons"] == []
    names = [loop["name"] for loop in found["loops"]]
    assert names == [*LOOP_NAMES, "rim"]
    cuff = found["loops"][names.index("left_cuff")]
    assert cuff["girth_m"] == pytest.approx(0.36, rel=1e-3)
    assert cuff["person_part"] == "hand"
    assert len(cuff["center"]) == 3
    assert found["size_advice"]["value"] == 1.0
    page = (out / "garment.html").read_text()
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert "http" not in re.sub(r"base64,[^\"]*", "", page)


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("*.yaml")), ids=lambda path: path.stem)
def test_the_scenario_that_is_written_equals_the_one_looked_at(path: Path, tmp_path: Path) -> None:
    words = ["--set", "plant.material.friction=0.4", "--seed", "7"]
    assert main(["garment", str(path), "--out", str(tmp_path), *words]) == 0
    expected = load_scenario(path, ["plant.material.friction=0.4"], 7)
    assert load_scenario(tmp_path / "garment.yaml") == expected


def test_a_file_becomes_a_scenario_with_its_path_beside_the_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_obj(tmp_path / "from" / "it's a: coat #1.obj", COAT, y_up=True)
    monkeypatch.chdir(tmp_path / "from")
    words = ["--set", "garment.mesh.up=y", "--out", "../to/there"]
    assert main(["garment", "it's a: coat #1.obj", *words]) == 0
    out = tmp_path / "to" / "there"
    written = load_scenario(out / "garment.yaml")
    mesh = present(written.garment.mesh)
    assert mesh.file == "../../from/it's a: coat #1.obj"
    base = load_scenario(SCENARIOS / "dummy_standing.yaml")
    assert replace(written, garment=base.garment) == replace(at_edges(base), garment=base.garment)
    assert written.garment.hold == "edges"
    words += ["--set", "garment.hold=shoulders"]
    assert main(["garment", "it's a: coat #1.obj", *words]) == 0
    assert load_scenario(out / "garment.yaml").garment.hold == "shoulders"
    monkeypatch.chdir("/")
    garment = build_garment(written.garment, 0.05, out)
    assert np.ptp(garment.rest_position, axis=0) == pytest.approx(
        np.ptp(COAT.rest_position, axis=0), abs=0.02
    )
    assert figures(out)["loops"][1]["girth_m"] == pytest.approx(0.30, rel=1e-3)


def test_the_path_is_right_through_a_linked_folder(tmp_path: Path) -> None:
    write_obj(tmp_path / "coat.obj", COAT)
    (tmp_path / "deep" / "real").mkdir(parents=True)
    (tmp_path / "link").symlink_to(tmp_path / "deep" / "real")
    out = tmp_path / "link"
    assert main(["garment", str(tmp_path / "coat.obj"), "--out", str(out)]) == 0
    written = load_scenario(out / "garment.yaml")
    assert (out / present(written.garment.mesh).file).is_file()


def test_a_person_of_another_scenario_wears_it(tmp_path: Path) -> None:
    giant = tmp_path / "giant.yaml"
    giant.write_text("person: {posture: sitting, measures: {hand_radius: 0.08}}\n")
    words = ["garment", "dummy_standing", "--person", str(giant), "--out", str(tmp_path / "out")]
    assert main(words) == 0
    found = figures(tmp_path / "out")
    assert found["fits"] is False
    assert "narrower than the hand" in found["reasons"][0]
    assert found["size_advice"]["measures"]["garment.coat.cuff_girth"] > 0.5
    written = load_scenario(tmp_path / "out" / "garment.yaml")
    assert written.person == load_scenario(giant).person
    assert written.garment == load_scenario(SCENARIOS / "dummy_standing.yaml").garment


def test_the_person_and_coat_are_those_that_the_seed_draws(tmp_path: Path) -> None:
    girths: list[tuple[float, float]] = []
    for seed in ("1", "2", "1"):
        out = tmp_path / f"{len(girths)}"
        assert main(["garment", "dummy_varied", "--seed", seed, "--out", str(out)]) == 0
        girths.append((figures(out)["loops"][1]["girth_m"], figures(out)["person_m"]["hand"]))
    assert girths[0] == girths[2]
    assert girths[0] != girths[1]


def test_a_closed_front_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_obj(tmp_path / "shirt.obj", closed_coat(COAT))
    status = main(["garment", str(tmp_path / "shirt.obj"), "--out", str(tmp_path / "out")])
    told = capsys.readouterr()
    assert "closed front" in told.out + told.err
    if status == 0:
        assert figures(tmp_path / "out")["fits"] is False


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["none.obj"], "none.obj"),
        (["none.yaml"], "none.yaml"),
        (["dummy_standin"], "did you mean dummy_standing?"),
        (["none.fbx"], "none.fbx"),
        (["dummy_standing", "--person", "nobody"], "nobody"),
        (["dummy_standing", "--set", "garment.cot.scale=1"], "garment.cot"),
        (["dummy_standing", "--set", "garment.coat.scale=0.5"], "garment.coat.scale: is 0.5"),
    ],
)
def test_what_cannot_be_used_is_told_in_one_line_and_nothing_is_written(
    words: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert told in one_line(["garment", *words, "--out", str(tmp_path / "out")], capsys)
    assert not (tmp_path / "out").exists()


def test_a_file_that_breaks_off_leaves_the_results_of_an_earlier_look(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = tmp_path / "coat.obj", tmp_path / "out"
    write_obj(path, COAT)
    assert main(["garment", str(path), "--out", str(out)]) == 0
    before = {each.name: each.read_bytes() for each in out.iterdir()}
    path.write_text(path.read_text()[:-200])
    capsys.readouterr()
    one_line(["garment", str(path), "--out", str(out)], capsys)
    assert {each.name: each.read_bytes() for each in out.iterdir()} == before


def test_no_input_is_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "garment.yaml"
    path.write_text("seed: 3\n")
    told = one_line(["garment", str(path), "--out", str(tmp_path)], capsys)
    assert "is read, too" in told
    assert path.read_text() == "seed: 3\n"
