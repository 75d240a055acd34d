"""Every scenario with and without arms: which runs there are, and what is made of their results."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from benchmarks.arms import __main__ as bench
from benchmarks.arms.__main__ import _SCENARIOS, GRIPPERS, METHODS, SCENARIOS, Case, tables
from drake_dress.diagrams.scenario import load_scenario


def result(case: Case, success: bool = True) -> dict[str, Any]:
    summary: dict[str, Any] = {
        "success": success,
        "reason": None if success else "left sleeve not on: s = 0.00 < 1.9",
        "dressing_time_s": 20.0 if success else None,
        "max_gripper_force_N": 15.0,
        "max_edge_strain": 0.05,
        "max_penetration_m": 0.001,
        "realtime_factor": 0.5,
    }
    if case.grippers == "panda":
        summary |= {
            "max_joint_speed_share": 0.9,
            "max_joint_torque_share": 0.4,
            "min_joint_margin_rad": 0.02,
            "arm_tracking_mm": {"median": 0.5, "p99": 2.5},
            "min_arms_apart_m": 0.08,
            "min_arm_to_person_m": 0.12,
        }
    return {"case": asdict(case), "status": int(not success), "summary": summary}


def test_every_scenario_that_dresses_is_run_with_and_without_arms() -> None:
    there = {p.stem for p in _SCENARIOS.glob("*.yaml")}
    assert set(SCENARIOS) == there - {"measured"}
    for name in SCENARIOS:
        for grippers in GRIPPERS:
            for method in METHODS:
                settings = [f"station.arms.model={grippers}", f"controller.method={method}"]
                load_scenario(_SCENARIOS / f"{name}.yaml", settings)


def test_runs_with_and_without_arms_stand_side_by_side() -> None:
    cases = [Case("lab", "full", grippers) for grippers in GRIPPERS]
    dressed, arms, reasons = tables([result(cases[0]), result(cases[1], success=False)])
    assert dressed.rows == [["lab, full", 20.0, 15.0, 5.0, 1.0, "no", 15.0, 5.0, 1.0]]
    assert arms.rows == [["lab, full", 0.9, 0.4, 0.02, 0.5, 2.5, 8.0, 12.0, 0.5]]
    assert reasons.rows == [["lab-full-panda", "left sleeve not on: s = 0.00 < 1.9"]]
    alone, _, _ = tables([result(cases[1])])
    assert alone.rows[0][1:5] == [None] * 4


def test_runs_in_a_file_are_not_run_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def run(case: Case, keep: Path | None, overrides: Sequence[str]) -> dict[str, Any]:
        asked.append(case.name)
        return result(case)

    monkeypatch.setattr(bench, "run", run)
    file = tmp_path / "results.json"
    words = ["--scenarios", "lab", "--methods", "full", "--json", str(file)]
    assert bench.main([*words, "--grippers", "panda"]) == 0
    assert bench.main([*words, "--kept"]) == 0
    assert bench.main(words) == 0
    assert asked == ["lab-full-panda", "lab-full-floating"]
    assert len(json.loads(file.read_text())["runs"]) == 2
    assert "2 runs, 1 of them not run yet" in capsys.readouterr().out
