"""What the command line tells of itself."""

from pathlib import Path

import pytest

from drake_dress.__main__ import BENCHMARKS, main

BENCHES = Path(__file__).resolve().parents[1] / "benchmarks"


def test_help_names_every_benchmark_that_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--help"]) == 0
    told = capsys.readouterr().out
    there = {path.parent.name for path in BENCHES.glob("*/__main__.py")}
    assert there == set(BENCHMARKS)
    for name in there:
        assert f"  {name} " in told
