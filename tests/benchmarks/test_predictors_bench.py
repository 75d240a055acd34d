"""Dressings with each predictor: which runs there are, and what is made of their results."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from benchmarks.predictors.__main__ import PREDICTORS, Case, figures, main, run, tables
from benchmarks.statistics import median_interval
from drake_dress.diagrams.scenario import load_scenario


def result(predictor: str, seed: int, time: float | None, force: float = 8.0) -> dict[str, Any]:
    return {
        "case": asdict(Case(predictor, seed)),
        "status": 0,
        "summary": {
            "success": time is not None,
            "dressing_time_s": time,
            "max_gripper_force_N": 2.0 * force,
        },
        "force_p99": force,
    }


def five(predictor: str, times: list[float | None], force: float) -> list[dict[str, Any]]:
    return [result(predictor, seed, time, force) for seed, time in enumerate(times)]


RESULTS = [
    *five("still", [20.0, 22.0, 24.0, None, 30.0], 9.0),
    *five("learned", [18.0, 19.0, 25.0, 21.0, None], 8.0),
]


def test_pairs_are_compared_seed_by_seed() -> None:
    by_predictor, beside = tables(RESULTS)
    assert by_predictor.rows[0][:3] == ["learned", 5, 4]
    assert [row[0] for row in beside.rows] == ["learned, still"]
    (row,) = beside.rows
    # pairs, both, only learned, only still, neither; less by 2, 3, −1 s, and by 1 N
    assert row[1:6] == [5, 3, 1, 1, 0]
    assert row[6] == "2.00 (-1.00 to 3.00)"
    assert row[7] == "1.00 (1.00 to 1.00)"


def test_figures_tell_whether_success_is_not_lower() -> None:
    found = {f.name: f for f in figures(RESULTS)}
    more = found["learned: dressed more than still"]
    assert (more.value, more.met) == (0, True)
    worse = figures([*RESULTS, result("still", 9, 20.0), result("learned", 9, None)])
    assert not {f.name: f for f in worse}["learned: dressed more than still"].met
    assert found["learned: time less than still, median"].value == 2.0


def test_runs_differ_in_the_predictor_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {}

    def kept(
        case: Case, scenario: Any, keep: Any, settings: list[str], seed: int, look: Any
    ) -> Any:
        given[case.predictor] = load_scenario(scenario, settings, seed)
        return {}

    monkeypatch.setattr("benchmarks.predictors.__main__.run_case", kept)
    for predictor in PREDICTORS:
        run(Case(predictor, 1234), None, ["duration=5"])
    assert {name: s.controller.predictor for name, s in given.items()} == {
        "learned": "learned",
        "still": "still",
        "constant_velocity": "constant_velocity",
        "damped_velocity": "constant_velocity",
        "ridge": "ridge",
        "recurrent": "recurrent",
    }
    decays = {s.controller.constant_velocity.decay_time for s in given.values()}
    assert len(decays) == 2
    for scenario in given.values():
        assert scenario.person == given["still"].person
        assert scenario.variation == given["still"].variation
        assert scenario.duration == 5.0


def test_wrong_names_are_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--predictors", "oracle"])
    assert ended.value.code == 2
    assert "oracle" in capsys.readouterr().err


@pytest.mark.parametrize("count", [1, 5, 40])
def test_interval_of_the_median_holds_it_nine_times_in_ten(count: int) -> None:
    rng = np.random.default_rng(count)
    held = []
    for _ in range(400):
        low, middle, high = median_interval(list(rng.normal(size=count)))
        assert low <= middle <= high
        held.append(low <= 0.0 <= high)
    assert np.mean(held) > (0.86 if count >= 5 else -1.0)
    if count == 40:
        assert np.mean(held) < 0.98


def test_interval_of_nothing_is_not_a_number() -> None:
    assert all(np.isnan(median_interval([])))
