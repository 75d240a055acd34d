"""The whole of explain: what it says, what it writes, and which effects it was allowed to try."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.sections.effects import effects
from drake_dress.discrepancy import report
from drake_dress.discrepancy.explained import Explained, explained
from drake_dress.errors import UserError
from drake_dress.file_output import EXPLAIN_FILES
from drake_dress.models.effects.mass import SurfaceDensity
from tests.discrepancy.data import SCENARIO, quick_scenario, recordings
from tests.models.effects.own import HemChain, registered

STAGES: list[str] = []


@pytest.fixture(scope="module")
def found() -> Iterator[Explained]:
    """What is said of a garment with a chain in its hem, of which a scenario knows nothing."""
    made = recordings(("sway",), [HemChain(mass=0.1)], 1.6)
    among = [HemChain.NAME, SurfaceDensity.NAME]
    with registered():
        yield explained(quick_scenario(), SCENARIO.parent, made, among, 1, STAGES.append)


def test_an_effect_of_a_users_own_is_named_in_its_own_words(found: Explained) -> None:
    assert found.verdict == "named"
    (effect,) = found.effects
    assert isinstance(effect, HemChain)
    (cause,) = found.causes
    assert abs(effect.mass - 0.1) < min(4.0 * cause.std["mass"], 0.02)
    assert str(found).startswith("What the simulation lacks is a chain in the hem (mass 0.")


def test_only_effects_that_were_allowed_are_tried(found: Explained) -> None:
    assert {c.name for c in found.candidates} == {"hem_chain", "surface_density"}
    assert {c["effect"] for c in found.content["candidates"]} == {"hem_chain", "surface_density"}


def test_the_residual_falls_toward_the_noise(found: Explained) -> None:
    marker = {when: value["marker_m"] for when, value in found.residual.items()}
    assert marker["noise"] < marker["after"] < 0.5 * marker["before"]


def test_stages_are_told(found: Explained) -> None:
    assert found.notes == ()
    assert STAGES[0] == "settling"
    assert "running on its own" in STAGES


def test_three_files_are_written_that_say_the_same(found: Explained, tmp_path: Path) -> None:
    out = tmp_path / "new" / "out"
    found.write(out)
    assert {file.name for file in out.iterdir()} == set(EXPLAIN_FILES)
    assert json.loads((out / "explanation.json").read_text()) == found.content
    again = load_scenario(out / "extended.yaml")
    assert effects(again.effects) == found.effects
    assert "a chain in the hem" in (out / "report.html").read_text()


def test_a_report_that_fails_costs_none_of_the_other_files(
    found: Explained,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fails(*_: object) -> str:
        raise RuntimeError("no\nfont")

    monkeypatch.setattr(report, "report_page", fails)
    (tmp_path / "report.html").write_text("of an earlier run")
    found.write(tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == set(EXPLAIN_FILES) - {"report.html"}
    told = capsys.readouterr().err
    assert told == f"drake-dress: {tmp_path / 'report.html'}: no font\n"


def test_a_folder_that_cannot_be_is_told(found: Explained, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match=r"out: .*file: cannot be written to"):
        found.write(tmp_path / "file")
