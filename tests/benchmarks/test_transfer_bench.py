"""Dressings in MuJoCo's world: which runs there are, and what is made of their results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from benchmarks.transfer.__main__ import WORLDS, Case, figures, main, run, tables
from drake_dress.diagrams.scenario import apply_variation, load_scenario


def result(world: str, seed: int, time: float | None, force: float = 8.0) -> dict[str, Any]:
    return {
        "case": asdict(Case(world, "dummy", "jacket", seed)),
        "status": 0,
        "summary": {
            "success": time is not None,
            "reason": None if time is not None else "left sleeve: off",
            "dressing_time_s": time,
            "arm_inside_left": True,
            "arm_inside_right": True,
            "s_dressed_left": 1.95 if time is not None else 1.8,
            "s_dressed_right": 2.0,
            "stays_on": True if time is not None else None,
            "max_gripper_force_N": 2.0 * force,
            "max_penetration_m": 0.002 * (seed + 1),
            "max_edge_strain": 0.1,
            "realtime_factor": 0.25,
            "wall_time_s": 240.0,
        },
        "force_p99": force,
    }


RESULTS = [
    *(result("implicit", seed, 20.0 + seed, 6.0) for seed in range(4)),
    *(result("mujoco", seed, 22.0 + seed if seed else None) for seed in range(4)),
]


def test_worlds_are_compared_seed_by_seed() -> None:
    worlds, beside, reasons = tables(RESULTS)
    assert [row[:3] for row in worlds.rows] == [["mujoco", 4, 3], ["implicit", 4, 4]]
    # both on, stay on, mm, deeper than 5 mm, strain, speed, wall time
    assert worlds.rows[0][-7:] == [3, 3, 8.0, 2, 0.1, 0.25, 240.0]
    (row,) = beside.rows
    # pairs, both, only mujoco, only implicit, neither; later by 2 s, and 2 N more
    assert row[:5] == [4, 3, 0, 1, 0]
    assert row[5].startswith("-2.00")
    assert row[6].startswith("-2.00")
    assert reasons.rows == [["mujoco", 0, "left sleeve: off"]]
    assert not tables(RESULTS[:4])[1].rows


def test_three_of_four_dressings_are_asked_in_the_other_world() -> None:
    found = {f.name: f for f in figures(RESULTS)}
    share = found["mujoco: runs dressed of 4"]
    assert (share.value, share.asked, share.met) == (75.0, 75.0, True)
    assert found["implicit: runs dressed of 4"].asked is None
    ends = [found[f"mujoco: {end} end of the 90 % interval"].value for end in ("lower", "upper")]
    assert 30.0 < ends[0] < 75.0 < ends[1] < 98.0
    assert found["mujoco: time to dress, median"].value == 24.0
    worse = figures([*RESULTS, result("mujoco", 9, None)])
    assert not {f.name: f for f in worse}["mujoco: runs dressed of 5"].met


def test_runs_differ_in_the_world_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {}

    def kept(
        case: Case, scenario: Any, keep: Any, settings: list[str], seed: int, look: Any
    ) -> Any:
        given[case.world] = apply_variation(load_scenario(scenario, settings, seed))
        return {}

    monkeypatch.setattr("benchmarks.transfer.__main__.run_case", kept)
    for world in WORLDS:
        run(Case(world, "dummy", "jacket", 1234), None, ["duration=5"])
    other, own = given["mujoco"], given["implicit"]
    assert (other.plant.integrator, own.plant.integrator) == ("mujoco", "implicit")
    other.plant.integrator = "implicit"
    assert other == own
    assert own.duration == 5.0


def test_results_are_kept_and_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A second call with the same root runs what is missing, and no seed twice."""
    ran: list[str] = []

    def once(case: Case, keep: Path | None, overrides: Sequence[str] = ()) -> dict[str, Any]:
        ran.append(case.name)
        assert case.seed >= 1000
        return result(case.world, case.seed, 20.0)

    monkeypatch.setattr("benchmarks.transfer.__main__.run", once)
    monkeypatch.setattr("benchmarks.transfer.__main__.import_mujoco", lambda: None)
    kept = str(tmp_path / "transfer.json")
    for count, new in ((1, 2), (3, 4)):
        draw = ["--draw", f"report:{count}", "--root", "7", "--json", kept, "--jobs", "1"]
        before = len(ran)
        assert main(draw) == 0
        assert len(ran) - before == new
    assert len(set(ran)) == len(ran)
    assert "90 % interval" in capsys.readouterr().out


def test_wrong_names_are_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--worlds", "newton"])
    assert ended.value.code == 2
    assert "newton" in capsys.readouterr().err
