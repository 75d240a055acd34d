"""The dressing experiments: which runs there are, and what is made of their results."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from benchmarks.dressing import __main__ as bench
from benchmarks.dressing.cases import (
    COATS,
    METHODS,
    PERSONS,
    SCENARIOS,
    VARIATIONS,
    Case,
    cases,
    scenario_of,
)
from benchmarks.dressing.drawn import drawn
from benchmarks.dressing.page import MAPS, study_page
from benchmarks.dressing.parquet import write_table
from benchmarks.dressing.tables import figure, tables
from benchmarks.statistics import wilson
from drake_dress.diagrams.scenario import apply_variation, load_scenario
from drake_dress.diagrams.scenario.coat import coat_parameters
from drake_dress.errors import UserError
from drake_dress.models.garment.coat import make_coat


def result(
    method: str = "full",
    seed: int = 0,
    success: bool = True,
    reason: str | None = None,
    time: float | None = 20.0,
) -> dict[str, Any]:
    count = 5 if success else 9
    series = {"time": [0.2 * k for k in range(count)]}
    for side in ("left", "right"):
        series |= {f"s_{side}": [0.1 * k for k in range(count)]}
        series |= {f"l_{side}": [0.01] * count, f"force_{side}": [5.0] * count}
    return {
        "case": asdict(Case(method, "dummy", "jacket", seed, "all")),
        "status": int(not success),
        "summary": {
            "success": success,
            "reason": reason,
            "arm_inside_left": True,
            "arm_inside_right": reason is None or "s = 0.00" not in reason,
            "s_left": 1.95 if success else 1.85,
            "s_right": 2.0,
            "dressing_time_s": time if success else None,
            "max_gripper_force_N": 15.0,
            "max_penetration_m": 0.001,
            "layers_crossed_at_end": 0,
            "realtime_factor": 0.5,
        },
        "force_p99": 11.0,
        "series": series,
    }


def test_a_part_of_the_runs_is_a_fair_part_of_all_groups() -> None:
    found = cases(METHODS, list(PERSONS), list(COATS), range(3))
    assert (
        len({c.name for c in found}) == len(found) == 3 * len(METHODS) * len(PERSONS) * len(COATS)
    )
    first = found[: len(found) // 3]
    assert {c.seed for c in first} == {0}
    assert {(c.method, c.person, c.coat) for c in first} == {
        (m, p, c) for m in METHODS for p in PERSONS for c in COATS
    }


@pytest.mark.parametrize("person", PERSONS)
@pytest.mark.parametrize("coat", COATS)
def test_every_run_is_a_scenario_that_its_seed_varies(person: str, coat: str) -> None:
    settings = [
        f"garment.coat={COATS[coat]}",
        f"variation={VARIATIONS['all']}",
        "controller.method=full",
    ]
    drawn = [
        apply_variation(load_scenario(SCENARIOS / PERSONS[person], settings, seed))
        for seed in (0, 1)
    ]
    assert {s.garment.coat.preset for s in drawn} == {coat}
    assert drawn[0].person.left_arm != drawn[1].person.left_arm
    assert drawn[0].plant.material.friction != drawn[1].plant.material.friction
    for first, second in (
        [asdict(s.person.measures) for s in drawn],
        [coat_parameters(s.garment.coat).lengths for s in drawn],
    ):
        # sizes that are not given follow from others
        assert not {n for n in first if first[n] is not None and first[n] == second[n]}
    for s in drawn:
        make_coat(coat_parameters(s.garment.coat), 0.06)


def test_both_arms_inside_below_the_shoulder_are_counted() -> None:
    short = "left sleeve not on: s = 1.85 < 1.9"
    results = [result(seed=k, success=k > 1, reason=short) for k in range(4)]
    by_method = tables(results)[0]
    assert by_method.rows[0][1:3] == [4, 2]
    assert by_method.rows[0][by_method.header.index("both arms inside, s < 1.9")] == 2


def test_tables_count_what_was_dressed_and_say_why_not() -> None:
    results = [result(seed=k, time=20.0 + k) for k in range(3)]
    results += [result("local", 0, False, "left sleeve not on: s = 0.00 < 1.9")]
    by_method, beside, _, by_group, reasons = tables(results)
    assert by_method.rows[0][:3] == ["full", 3, 3]
    assert by_method.rows[0][4] == 21.0
    assert by_method.rows[1][:3] == ["local", 1, 0]
    assert [row[-2] for row in by_method.rows] == [0, 0]
    assert [row[0] for row in by_group.rows] == ["full, dummy, jacket", "local, dummy, jacket"]
    assert beside.rows == [["local", 1, 0, 1, 0, 0, None]]
    assert reasons.rows == [["local", "left sleeve not on", 1]]
    assert figure(results).lstrip().startswith("<?xml")


def test_a_study_has_a_page_and_a_table_of_all_runs(tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    results = [
        result(seed=k, success=k != 1, reason=None if k != 1 else "left <sleeve> not on: s = 1")
        for k in range(6)
    ]
    kept = tmp_path / "runs" / "full-dummy-jacket-1-all"
    kept.mkdir(parents=True)
    (kept / "replay.html").write_text("")
    page = study_page(results, drawn, tmp_path / "page.html")
    assert "5 of 6 dressed" in page
    assert page.count("<img") == len(MAPS)
    assert 'href="runs/full-dummy-jacket-1-all/replay.html"' in page
    assert "left &lt;sleeve&gt; not on" in page
    write_table(tmp_path / "runs.parquet", results, drawn)
    table = pq.read_table(tmp_path / "runs.parquet").to_pylist()
    assert [row["seed"] for row in table] == list(range(6))
    for row, r in zip(table, results, strict=True):
        scenario = apply_variation(scenario_of(Case(**r["case"])))
        assert row["success"] == r["summary"]["success"]
        assert row["drawn.fabric_friction"] == scenario.plant.material.friction
        assert row["drawn.body_upper_arm_length"] == scenario.person.measures.upper_arm_length


def test_methods_are_held_against_full_where_all_else_is_the_same() -> None:
    results = [result(seed=k, time=20.0) for k in range(4)]
    results += [result("global", k, k < 2, "no", time=20.0 + 3.0 * k) for k in (0, 1, 2, 7)]
    _, beside, *_ = tables(results)
    assert beside.rows == [["global", 3, 2, 1, 0, 0, 1.5]]


def test_how_far_runs_came_is_told_by_hands_that_stay_in() -> None:
    def came(left: list[float], right: list[float], dressed: float | None = None) -> dict[str, Any]:
        r = result(seed=0, success=dressed is not None, time=dressed)
        r["series"] |= {"s_left": left, "s_right": right}
        return r

    out, brief, on = [0.0] * 20, [0.0, 0.5, 0.5] + [0.0] * 17, [0.0] * 5 + [1.0] * 15
    results = [
        came(brief, out),  # a hand that slips out at once is not in
        came(on, out),
        came(on, [*on[:-1], 0.0]),  # in, and lost
        came(on, [0.0] * 8 + [1.0] * 12, dressed=3.6),
    ]
    _, _, stages, _, _ = tables(results)
    assert stages.rows == [["full", 3, 1.0, 2, pytest.approx(0.3), 1, pytest.approx(2.0), 1]]


def test_runs_in_a_file_are_not_run_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def run(case: Case, keep: Path | None, overrides: Sequence[str]) -> dict[str, Any]:
        asked.append(case)
        return result(case.method, case.seed)

    monkeypatch.setattr(bench, "run", run)
    file = tmp_path / "results.json"
    words = ["--methods", "full", "--persons", "dummy", "--coats", "jacket", "--json", str(file)]
    assert bench.main([*words, "--seeds", "0-1"]) == 0
    assert bench.main([*words, "--seeds", "0-2"]) == 0
    assert [c.seed for c in asked] == [0, 1, 2]
    assert len(json.loads(file.read_text())["runs"]) == 3
    assert "| full |" in capsys.readouterr().out


def test_a_file_of_something_else_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "results.json"
    file.write_text("{}x")
    with pytest.raises(UserError, match="expected results"):
        bench.main(["--json", str(file), "--kept"])


@pytest.mark.parametrize(("right", "count"), [(0, 5), (5, 5), (3, 10), (90, 100)])
def test_the_interval_holds_the_share_and_stays_within_all(right: int, count: int) -> None:
    low, high = wilson(right, count)
    assert 0.0 <= low <= right / count <= high <= 1.0
    wider = wilson(right, count)[1] - wilson(right, count)[0]
    assert wider > wilson(10 * right, 10 * count)[1] - wilson(10 * right, 10 * count)[0]


def test_the_interval_of_none_and_of_all_ends_there() -> None:
    """And not a rounding beyond it, which was told as -0 %."""
    for count in range(1, 60):
        assert f"{wilson(0, count)[0]:.0f}" == "0"
        assert 1.0 - 1e-12 < wilson(count, count)[1] <= 1.0
