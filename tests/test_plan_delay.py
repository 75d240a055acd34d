"""The plan delay measured on a machine, and its use in a scenario."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from drake_dress.diagrams.scenario import load_scenario, resolved_yaml
from drake_dress.errors import UserError
from drake_dress.plan_delay import LEAST, keep_plan_delay, kept_plan_delay


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "drake_dress"


def scenario(tmp_path: Path, **mpc: float | str) -> Path:
    path = tmp_path / "s.yaml"
    path.write_text(yaml.safe_dump({"controller": {"global_mpc": mpc}}), encoding="utf-8")
    return path


def test_what_is_kept_covers_its_share_of_the_solves() -> None:
    assert kept_plan_delay() is None
    solve = np.random.default_rng(0).gamma(3.0, 0.1, size=400)
    seconds, path = keep_plan_delay(solve)
    assert kept_plan_delay() == seconds
    assert path.exists()
    assert np.mean(solve <= seconds) == pytest.approx(0.95, abs=0.01)


def test_few_solves_say_nothing() -> None:
    with pytest.raises(ValueError, match="expected"):
        keep_plan_delay(np.full(LEAST - 1, 0.1))
    assert kept_plan_delay() is None


@pytest.mark.parametrize("text", ["", "{", "[]", '{"seconds": "x"}', '{"seconds": -1}', "1"])
def test_a_damaged_file_counts_as_none(cache: Path, text: str) -> None:
    cache.mkdir(parents=True)
    (cache / "plan_delay.json").write_text(text, encoding="utf-8")
    assert kept_plan_delay() is None


@pytest.mark.parametrize(
    ("solve", "step", "delay"), [(0.31, 0.2, 0.4), (0.4, 0.2, 0.4), (0.05, 0.1, 0.1)]
)
def test_measured_is_the_least_multiple_that_holds_it(
    tmp_path: Path, solve: float, step: float, delay: float
) -> None:
    keep_plan_delay(np.full(LEAST, solve))
    path = scenario(tmp_path, delay="measured", time_step=step)
    loaded = load_scenario(path)
    assert loaded.controller.global_mpc.delay == pytest.approx(delay)
    plain = scenario(tmp_path, time_step=step)
    assert load_scenario(plain, ["controller.global_mpc.delay=measured"]) == loaded
    # a logged scenario gives the same on another machine
    path.write_text(resolved_yaml(loaded), encoding="utf-8")
    keep_plan_delay(np.full(LEAST, 0.01))
    assert load_scenario(path) == loaded


def test_without_a_measurement_the_command_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="bench delay") as told:
        load_scenario(scenario(tmp_path, delay="measured"))
    assert told.value.key == "controller.global_mpc.delay"


def test_a_machine_too_slow_for_the_period_is_told(tmp_path: Path) -> None:
    keep_plan_delay(np.full(LEAST, 0.9))
    with pytest.raises(UserError, match="expected less than the period"):
        load_scenario(scenario(tmp_path, delay="measured"))


def test_other_words_are_no_delay(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="measure"):
        load_scenario(scenario(tmp_path, delay="measure"))
