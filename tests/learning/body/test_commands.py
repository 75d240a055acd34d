import sys
from pathlib import Path

import pytest

from drake_dress.__main__ import main
from drake_dress.learning.body import commands
from drake_dress.models.human.skin.body_file import read_body
from tests.learning.body.model import small_model


def test_command_writes_the_body_of_the_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(commands, "read_anny", small_model)
    assert main(["dataset", "body", "--out", str(tmp_path / "new")]) == 0
    assert read_body(tmp_path / "new" / "body.npz").vertex_count == 5
    assert "body.npz: " in capsys.readouterr().out


def test_missing_package_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # what Python does for a package that is not installed
    monkeypatch.setitem(sys.modules, "anny", None)
    assert main(["dataset", "body", "--out", str(tmp_path / "new")]) == 2
    told = capsys.readouterr().err
    assert "drake_dress[bodies]" in told
    assert len(told.splitlines()) == 1
    assert not (tmp_path / "new").exists()
