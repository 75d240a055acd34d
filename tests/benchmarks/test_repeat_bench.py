"""Runs of one seed are compared bit for bit."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from benchmarks.logged import numbers_that_differ
from benchmarks.repeat import __main__ as repeat
from drake_dress.errors import UserError
from tests.report import synthetic

QUICK = ["plant.spacing=0.06", "controller.spacing=0.06", "duration=1.2"]


def log(path: Path, values: dict[str, np.ndarray]) -> Path:
    with h5py.File(path, "w") as file:
        for name, value in values.items():
            file[name] = value
    return path


@pytest.mark.parametrize(
    ("changed", "found"),
    [
        ({}, []),
        ({"a/x": np.array([1.0, np.nan, 3.0 + 1e-15])}, ["a/x"]),
        ({"a/x": np.array([1.0, np.nan])}, ["a/x"]),
        ({"solve_time": np.array([9.0])}, []),
        ({"b": np.array([1])}, ["b"]),
    ],
)
def test_what_differs_is_named(
    tmp_path: Path, changed: dict[str, np.ndarray], found: list[str]
) -> None:
    values = {"a/x": np.array([1.0, np.nan, 3.0]), "solve_time": np.array([2.0])}
    one, other = log(tmp_path / "1", values), log(tmp_path / "2", values | changed)
    with h5py.File(one) as first, h5py.File(other) as second:
        assert numbers_that_differ(first, second) == (1, found)


def test_a_run_is_the_same_under_load_and_in_several_processes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # the two that have least in common
    monkeypatch.setattr(repeat, "CASES", (repeat.CASES[0], repeat.CASES[3]))
    settings = [word for item in QUICK for word in ("--set", item)]
    assert repeat.main(["--out", str(tmp_path), *settings]) == 0
    shown = capsys.readouterr().out
    assert shown.count("0 differ") == 2


@pytest.mark.parametrize(("value", "status"), [(1.0, 0), (1.0 + 1e-15, 1)])
def test_runs_are_compared_with_the_log_of_another_version(
    value: float, status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    garment = synthetic.coat(0.06)
    before, made = tmp_path / "before.h5", tmp_path / "made.h5"
    for path in (before, made):
        synthetic.write(path, garment, synthetic.dressing(garment, count=3))
    with h5py.File(made, "r+") as file:
        file["garment/rest_position"][0, 0] *= value

    def run_scenario(_: Path, out: Path, *__: object) -> tuple[None, None]:
        out.mkdir(parents=True)
        shutil.copy(made, out / "run.h5")
        return None, None

    monkeypatch.setattr(repeat, "run_scenario", run_scenario)
    monkeypatch.setattr(repeat, "CASES", (repeat.CASES[0],))
    assert repeat.main(["--out", str(tmp_path / "out"), "--against", str(before)]) == status


def test_a_log_to_compare_with_that_cannot_be_read_is_told_before_anything_runs(
    tmp_path: Path,
) -> None:
    with pytest.raises(UserError, match=r"missing\.h5"):
        repeat.main(["--out", str(tmp_path), "--against", str(tmp_path / "missing.h5")])
