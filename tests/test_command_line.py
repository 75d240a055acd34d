"""What the command line tells of itself."""

import errno
from pathlib import Path

import pytest

from drake_dress.__main__ import BENCHMARKS, main
from drake_dress.diagrams import run

BENCHES = Path(__file__).resolve().parents[1] / "benchmarks"


def test_help_names_every_benchmark_that_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--help"]) == 0
    told = capsys.readouterr().out
    there = {path.parent.name for path in BENCHES.glob("*/__main__.py")}
    assert there == set(BENCHMARKS)
    for name in there:
        assert f"  {name} " in told


def test_a_full_disk_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "place/run.h5")

    monkeypatch.setattr(run, "run_scenario", full)
    assert main(["run", "scenarios/dummy_standing.yaml", "--out", str(tmp_path)]) == 1
    assert capsys.readouterr().err == "drake-dress: place/run.h5: No space left on device\n"
