"""Shipped scenarios are found by name, from any folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from drake_dress.__main__ import main
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.errors import UserError
from drake_dress.shipped import scenario_file, shipped_scenarios

NAMES = sorted(shipped_scenarios())


@pytest.mark.parametrize("name", NAMES)
def test_a_name_leads_to_its_scenario_from_any_folder(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert load_scenario(scenario_file(name)).duration > 0.0


def test_all_are_listed_each_with_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenarios"]) == 0
    rows = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert [name for name, _ in rows] == NAMES
    assert "dummy_standing" in NAMES
    assert all(sentence.endswith(".") and len(sentence) > 20 for _, sentence in rows)


def test_a_file_goes_before_a_scenario_of_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lab").write_text("duration: 3.0\n")
    assert load_scenario(scenario_file("lab")).duration == 3.0


def test_a_directory_of_its_name_does_not_hide_a_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lab").mkdir()
    assert scenario_file("lab").name == "lab.yaml"


@pytest.mark.parametrize("given", ["lab.yaml", "./lab", "some/lab"])
def test_what_is_written_as_a_path_is_one(
    given: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert scenario_file(given) == Path(given)


@pytest.mark.parametrize(("given", "told"), [("dummy_standin", "dummy_standing?"), ("x", "lab")])
def test_a_name_that_is_none_is_told_with_those_there_are(given: str, told: str) -> None:
    with pytest.raises(UserError, match=told):
        scenario_file(given)


def test_a_run_of_an_unknown_name_ends_as_unusable(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "dumy_standing", "--no-meshcat"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "did you mean dummy_standing?" in error
