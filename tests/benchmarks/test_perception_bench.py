"""Tracking of recorded dressings: what is recorded, compared and told."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.perception.__main__ import main
from benchmarks.perception.recording import Recording
from benchmarks.perception.tables import figures, tables, tell
from benchmarks.perception.tracking import WAYS, Case, run

NAMES = (
    *("node_mean_m", "hidden_mean_m", "hidden_share", "armhole_median_m", "armhole_95_m"),
    *("direction_median_deg", "direction_95_deg"),
)
QUICK = [
    *("duration=2.1", "plant.spacing=0.05", "controller.spacing=0.06", "perception.spacing=0.05"),
    "perception.material.damping=0.02",
]


def result(seed: int, error: float, person: str = "dummy") -> dict[str, Any]:
    ways = {way: dict.fromkeys(NAMES, (1.0 if way == "tracker" else 3.0) * error) for way in WAYS}
    return {"case": asdict(Case(person, seed)), "summary": {"success": True, "ways": ways}}


def test_errors_are_told_as_means_and_worst_runs_beside_what_is_asked() -> None:
    ways, by_person = tables([result(0, 0.01), result(1, 0.03), result(0, 0.02, "wheelchair")])
    rows = {row[0]: row[1:] for row in ways.rows}
    assert rows["tracker"][0] == "2.0 (3.0)"
    assert rows["simulation alone"][0] == "6.0 (9.0)"
    assert rows["asked of the tracker"][:4] == [1.5, 2.5, 1.0, 2.5]
    assert [row[:3] for row in by_person.rows] == [
        ["dummy", 2, "2.0 (3.0)"],
        ["wheelchair", 1, "2.0 (2.0)"],
    ]


@pytest.mark.parametrize(("error", "met"), [(0.009, True), (0.011, False)])
def test_the_tracker_is_asked_for_its_errors(error: float, met: bool) -> None:
    found = {f.name: f for f in figures([result(0, error)])}
    assert found["tracker: armhole, median"].met is met
    assert found["tracker: armhole, median"].value == pytest.approx(100.0 * error)
    assert found["tracker: nodes, as a share of the simulation alone"].value == pytest.approx(1 / 3)


def test_without_results_nothing_is_told() -> None:
    assert figures([]) == []
    assert all(not table.rows or len(table.rows) == 1 for table in tables([]))


def test_a_dressing_is_recorded_once_and_tracked_in_each_way(tmp_path: Path) -> None:
    case = Case("dummy", 3)
    first = run(case, tmp_path, QUICK)
    recording = Recording.load(tmp_path / "dummy-3.npz")
    assert recording.time[-1] == pytest.approx(2.1, abs=0.04)
    assert recording.depth.shape == recording.labels.shape == (21, 2, 240, 424)
    assert (recording.labels == 100).any(axis=(1, 2, 3)).all()
    near = recording.depth_of(5)
    assert 0.5 < np.median(near[near > 0.0]) < 3.0
    ways = first["summary"]["ways"]
    assert set(ways) == set(WAYS)
    for way in WAYS:
        assert 0.0 < ways[way]["node_mean_m"] < 0.3
    # none of them is another one
    assert len({ways[way]["node_mean_m"] for way in WAYS}) == len(WAYS)
    assert "simulation alone" in tell(first["summary"])
    time = (tmp_path / "dummy-3.npz").stat().st_mtime_ns
    assert run(case, tmp_path, QUICK) == first
    assert (tmp_path / "dummy-3.npz").stat().st_mtime_ns == time


def test_help_says_what_is_measured(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "tracked" in capsys.readouterr().out
