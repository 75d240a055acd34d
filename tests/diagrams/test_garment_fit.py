"""A run is refused if its garment cannot go on, warned of if it is tight, and else silent."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from drake_dress.__main__ import main
from drake_dress.diagrams.garment_fit import advice_on, check_fit, judged, key_of
from drake_dress.diagrams.scenario import Scenario, apply_variation, load_scenario
from drake_dress.diagrams.scenario.schema import Garment, Mesh
from drake_dress.diagrams.setup import read_setup
from drake_dress.errors import UserError
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.fit import Finding, Fit, person_girths
from drake_dress.models.garment.fit.judge import ARMHOLE, ARMHOLE_AT_EDGES, CUFF
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.body import BodyMeasures
from tests.closed_coat import closed_coat
from tests.present import present

SCENARIOS = Path(__file__).parents[2] / "scenarios"
DUMMY = SCENARIOS / "dummy_standing.yaml"
PERSON = person_girths(BodyMeasures())
COARSE = ["plant.spacing=0.05", "controller.spacing=0.06"]
# A cuff a little narrower than the hand.
NARROW = f"garment.coat.cuff_girth={0.97 * CUFF.least * PERSON.hand:.4f}"
TIGHT_ARMHOLE = 0.5 * (ARMHOLE.fails + ARMHOLE.tight)


def fit_of(scenario: Scenario, base: Path = SCENARIOS) -> Fit:
    return judged(scenario.garment, scenario.person, (0.05, 0.05), base).fit


def write_obj(path: Path, mesh: GarmentMesh) -> None:
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in mesh.rest_position]
    lines += [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
    path.write_text("\n".join(lines) + "\n")


def check(*settings: str, source: Path = DUMMY) -> None:
    scenario = apply_variation(load_scenario(source, [*COARSE, *settings]))
    check_fit(read_setup(scenario, source))


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("*.yaml")), ids=lambda path: path.stem)
def test_the_shipped_scenarios_fit(path: Path) -> None:
    scenario = load_scenario(path)
    fit = fit_of(apply_variation(scenario))
    # a gown that is put on from the front is not judged yet
    if scenario.station.side == "front":
        assert fit.fits is None
        assert {finding.level for finding in fit.reasons} <= {"unknown"}
        return
    assert fit.fits is True
    assert fit.reasons == ()


@pytest.mark.parametrize("preset", ["jacket", "overcoat"])
def test_all_drawn_variations_fit(preset: str) -> None:
    coat = "" if preset == "jacket" else "{preset: overcoat, shoulder_width: 0.52}"
    settings = [f"garment.coat={coat}"] if coat else []
    varied = load_scenario(SCENARIOS / "dummy_varied.yaml", settings)
    for seed in range(30):
        fit = fit_of(apply_variation(replace(varied, seed=seed)))
        assert fit.reasons == (), seed


def test_a_run_with_a_garment_that_fits_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    check()
    assert capsys.readouterr() == ("", "")


def test_a_cuff_narrower_than_the_hand_is_refused_by_its_key(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(UserError, match="narrower than the hand") as caught:
        check(NARROW)
    assert caught.value.key == "garment.coat.cuff_girth"
    assert caught.value.source == str(DUMMY)
    assert capsys.readouterr() == ("", "")


def test_a_refused_run_ends_with_one_line_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = [word for each in (*COARSE, NARROW) for word in ("--set", each)]
    words = ["run", str(DUMMY), "--no-meshcat", "--out", str(tmp_path / "out"), *settings]
    assert main(words) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith(f"drake-dress: {DUMMY}: garment.coat.cuff_girth: ")
    assert told.err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_what_is_tight_is_told_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    girth = TIGHT_ARMHOLE * PERSON.upper_arm
    check(f"garment.coat.armhole_girth={girth:.4f}", f"garment.coat.cuff_girth={girth - 0.02:.4f}")
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    assert told.err.startswith(f"{DUMMY}: garment.coat.armhole_girth: the armholes are tight")


def test_a_file_with_a_closed_front_is_refused_by_its_key(tmp_path: Path) -> None:
    write_obj(tmp_path / "shirt.obj", closed_coat(make_coat(COATS["overcoat"], 0.05)))
    path = tmp_path / "mine.yaml"
    path.write_text("garment: {mesh: {file: shirt.obj}}\n")
    with pytest.raises(UserError, match="closed front") as caught:
        check(source=path)
    assert caught.value.source in (str(path), str(tmp_path / "shirt.obj"))


def test_findings_are_told_by_the_keys_of_the_garment() -> None:
    coat, mesh = Garment(), Garment(mesh=Mesh(file="a.obj"))
    size, kind = Finding("tight", "cuff_girth", "…"), Finding("cannot", "", "…")
    assert key_of(coat, size) == "garment.coat.cuff_girth"
    assert key_of(mesh, size) == "garment.mesh.scale"
    assert key_of(mesh, kind) == "garment.mesh.file"


@pytest.mark.parametrize("scale", [0.8, 1.0])
def test_the_advised_scale_of_a_coat_fits(scale: float) -> None:
    scenario = load_scenario(DUMMY, [f"garment.coat.scale={scale}", NARROW])
    advice = advice_on(scenario.garment, fit_of(scenario))
    assert advice.key == "garment.coat.scale"
    assert f"{advice.key}: {advice.value:g}" in advice.sentence
    assert present(advice.value) > scale
    larger = load_scenario(DUMMY, [NARROW, f"{advice.key}={advice.value}"])
    assert fit_of(larger).reasons == ()


@pytest.mark.parametrize("scale", [1.0, 1.1])
def test_the_advised_measures_of_a_coat_fit(scale: float) -> None:
    small = [f"garment.coat.scale={scale}", "garment.coat.cuff_girth=0.2"]
    small += ["garment.coat.armhole_girth=0.38"]
    scenario = load_scenario(DUMMY, small)
    advice = advice_on(scenario.garment, fit_of(scenario))
    assert set(advice.measures) == {"garment.coat.cuff_girth", "garment.coat.armhole_girth"}
    measures = [f"{key}={value}" for key, value in advice.measures.items()]
    assert fit_of(load_scenario(DUMMY, [*small, *measures])).reasons == ()
    # and a scale of 1.1 needs less
    assert all(value < 0.6 / scale for value in advice.measures.values())


def test_the_advised_scale_of_a_file_fits(tmp_path: Path) -> None:
    write_obj(tmp_path / "coat.obj", make_coat(COATS["jacket"], 0.05).scaled(0.6))
    mesh = Mesh(file="coat.obj", scale=1.1)
    scenario = load_scenario(DUMMY)
    scenario.garment = Garment(mesh=mesh)
    fit = fit_of(scenario, tmp_path)
    assert fit.fits is False
    advice = advice_on(scenario.garment, fit)
    assert advice.key == "garment.mesh.scale"
    assert advice.measures == {}
    scenario.garment = Garment(mesh=replace(mesh, scale=present(advice.value)))
    assert fit_of(scenario, tmp_path).reasons == ()


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["garment.coat.scale=1.1"], "but 0.7 to 1.4 are allowed"),
        # the front opening grows with the scale, too
        (["garment.coat.cuff_girth=0.42"], "but such a coat cannot be cut (front_opening)"),
    ],
)
def test_a_scale_that_cannot_be_used_is_not_advised(settings: list[str], told: str) -> None:
    large = "person.measures.hand_radius=0.08"
    scenario = load_scenario(DUMMY, [large, *settings])
    advice = advice_on(scenario.garment, fit_of(scenario))
    assert advice.value is None
    assert told in advice.sentence
    # a wider cuff alone would do
    measures = [f"{key}={value}" for key, value in advice.measures.items()]
    assert len(measures) == 1
    assert fit_of(load_scenario(DUMMY, [large, *settings, *measures])).reasons == ()


def test_a_coat_held_at_its_edges_may_have_narrower_armholes() -> None:
    girth = 0.5 * (ARMHOLE_AT_EDGES.fails + ARMHOLE.fails) * PERSON.upper_arm
    told = {}
    for hold in ("shoulders", "edges"):
        settings = [*COARSE, f"garment.coat.armhole_girth={girth:.4f}", f"garment.hold={hold}"]
        told[hold] = fit_of(load_scenario(DUMMY, settings)).fits
    assert told == {"shoulders": False, "edges": True}
