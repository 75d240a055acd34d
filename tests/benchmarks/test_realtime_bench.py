from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from benchmarks.realtime import __main__ as realtime
from drake_dress.errors import UserError


def checkout(folder: Path) -> Path:
    (folder / "drake_dress").mkdir(parents=True)
    (folder / "drake_dress" / "__main__.py").touch()
    return folder


@pytest.mark.parametrize(("factor", "status"), [(1.2, 0), (0.8, 1)])
def test_versions_take_turns_and_are_compared_seed_by_seed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, factor: float, status: int
) -> None:
    before = checkout(tmp_path / "before")
    runs: list[tuple[str, int, tuple[str, ...]]] = []

    def run_scenario(
        scenario: Path,
        out: Path,
        overrides: Sequence[str],
        seed: int,
        report: bool,
        one_process: bool,
        checkout: Path,
    ) -> tuple[int, str]:
        version = "before" if checkout == before else "now"
        assert scenario == checkout / "scenarios" / "dummy_sitting.yaml"
        assert not one_process
        runs.append((version, seed, tuple(overrides)))
        speed = {"before": 1.0, "now": factor}[version] * seed
        out.mkdir()
        (out / "summary.json").write_text(json.dumps({"realtime_factor": speed}))
        return 0, ""

    monkeypatch.setattr(realtime, "run_scenario", run_scenario)
    file = tmp_path / "figures.json"
    words = ["--before", str(before), "--scenario", "dummy_sitting", "--seeds", "2-4"]
    words += ["--set", "duration=9", "--also", "plant.spacing=0.02", "--json", str(file)]
    assert realtime.main(words) == status
    one: list[tuple[str, tuple[str, ...]]] = [("before", ("duration=9",)), ("now", ("duration=9",))]
    one.append(("now", ("plant.spacing=0.02", "duration=9")))
    assert runs[3:] == [(name, seed, said) for seed in (2, 3, 4) for name, said in one]
    assert all("duration=2" in said for _, _, said in runs[:3])
    figures = json.loads(file.read_text())["figures"]
    assert [figure["value"] for figure in figures] == [pytest.approx(factor)] * 2
    assert [figure["met"] for figure in figures] == [status == 0] * 2


def test_a_folder_without_the_code_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"--before: .* is no checkout"):
        realtime.main(["--before", str(tmp_path)])


def test_a_run_that_fails_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = checkout(tmp_path / "before")
    monkeypatch.setattr(realtime, "run_scenario", lambda *_, **__: (2, "exit 2: no such key"))
    with pytest.raises(UserError, match="before: exit 2: no such key"):
        realtime.main(["--before", str(before)])
