"""Lab and run in two processes, with a network of their own, and faults in between."""

import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.hardware import __main__ as bench
from benchmarks.hardware.__main__ import main
from benchmarks.hardware.faults import (
    BELIEFS,
    FAULTS,
    REACTIONS,
    LabTooSlowError,
    inject,
    untold,
)
from benchmarks.hardware.parts import Case, Conditions, growth, run
from benchmarks.hardware.two_processes import Plan, available, memory_of, play
from drake_dress.models.supervision.injection import KINDS
from drake_dress.models.supervision.wrong_points import WRONG_POINTS
from drake_dress.report.log import RunLog
from drake_dress.report.summary import summarize
from tests.present import present

SCENARIO = "scenarios/lab.yaml"
pytestmark = pytest.mark.alone
needs_network = pytest.mark.skipif(not available(), reason="no right to a network namespace")


@needs_network
def test_a_run_drives_a_lab_of_another_process(tmp_path: Path) -> None:
    done = play(
        Plan(
            SCENARIO,
            str(tmp_path),
            ["plant.spacing=0.05", "controller.spacing=0.06", "duration=4", "lab.rest=1.0"],
            timeout=400.0,
        )
    )
    assert (done.run_status, done.lab_status) == (1, 1), done.run_words + done.lab_words
    for name in ("left arm", "right arm", "garment", "person"):
        assert f"heard: {name}" in done.run_words
    with RunLog.open(tmp_path / "run" / "run.h5") as log:
        assert log.estimated
        assert log.intent is None
        assert log.ended_by is None
        assert log.time[-1] > 3.5
        summary = summarize(log, wall_time=0.0)
        assert summary["command_rate_hz"] > 100.0
        assert summary["start_up_s"] > 0.0
        assert summary["fell_behind_s"] >= 0.0
        travelled = np.linalg.norm(np.diff(log.gripper_position["left"][5:], axis=0), axis=1)
        assert travelled.sum() > 0.05
    with RunLog.open(tmp_path / "lab" / "run.h5") as log:
        assert not log.estimated
        np.testing.assert_array_equal(present(log.intent), 0)
        assert "holds, ended" in log.events[-1]


@needs_network
@pytest.mark.parametrize("kind", ["killed", "disk_full", "random"])
def test_a_fault_is_answered_as_stated(kind: str, tmp_path: Path) -> None:
    seed = int(np.random.SeedSequence().generate_state(1)[0])
    if kind == "random":
        kind = str(np.random.default_rng(seed).choice(list(REACTIONS)))
    print(f"kind {kind}, seed {seed}")
    assert kept_up(kind, seed, tmp_path)["wrong"] == []


def kept_up(kind: str, seed: int, out: Path) -> dict[str, Any]:
    """Returns what came of a fault, at the highest rate that this machine keeps up with."""
    try:
        return inject(kind, seed, SCENARIO, out / "half", rate=0.5)
    except LabTooSlowError:
        return inject(kind, seed, SCENARIO, out / "fifth", rate=0.2)


def test_memory_is_that_of_a_process_and_of_those_it_started() -> None:
    child = "kept = b'1' * (80 << 20); print(len(kept), flush=True); input()"
    parent = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"
    with subprocess.Popen(
        [sys.executable, "-c", parent], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        assert 80.0 < memory_of(process.pid) < 150.0
        process.communicate(b"\n")
    assert np.isnan(memory_of(process.pid))


@needs_network
def test_a_run_without_a_lab_tells_who_is_silent(tmp_path: Path) -> None:
    done = play(
        Plan(
            SCENARIO,
            str(tmp_path),
            ["plant.spacing=0.06", "controller.spacing=0.06", "lab.wait=1.0"],
            ["station.hardware.lcm_url=udpm://239.255.76.68:7668?ttl=0"],
            ["station.hardware.wait=1.0"],
            timeout=60.0,
        )
    )
    assert done.run_status == 2
    assert "station.hardware: PANDA_STATUS_LEFT is silent" in done.run_words
    assert "Traceback" not in done.run_words
    assert not (tmp_path / "run" / "run.h5").exists()
    assert done.lab_status == 1
    assert "no commands came" in done.lab_words


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--only", "nonsense"], "'nonsense' is none of"),
        (["--kinds", "nonsense"], "'nonsense' is none of"),
        (["--repeats", "0"], "--repeats: '0' is no count, expected 1 or more"),
        (["--jobs", "-1"], "--jobs: '-1' is no count, expected 1 or more"),
    ],
)
def test_what_cannot_be_measured_is_told(
    words: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


def test_commands_are_measured_often_and_told_with_their_spread(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    rates = iter([201.0, 195.9, 198.0])

    def noted(
        case: Case, conditions: Conditions, out: Path, overrides: list[str]
    ) -> dict[str, Any]:
        latency = {"median": 5.0 + case.seed, "p99": 24.0 + case.seed}
        facts = {"command_rate_hz": next(rates), "command_latency_ms": latency, "start_up_s": 8.0}
        return {"case": asdict(case), "summary": facts}

    monkeypatch.setattr(bench, "run", noted)
    monkeypatch.setattr(bench, "available", lambda: True)
    assert main(["--only", "commands", "--repeats", "3"]) == 0
    told = capsys.readouterr().out
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in told.splitlines()]
    assert ["rate, Hz", "200 ± 2 %", "198.0", "195.9", "201.0", "2 of 3"] in rows
    assert ["status to command, median, ms", "≤ 10", "6.0", "5.0", "7.0", "3 of 3"] in rows
    assert ["status to command, 99 %, ms", "≤ 25", "25.0", "24.0", "26.0", "2 of 3"] in rows


def test_what_was_measured_is_kept_and_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def noted(
        case: Case, conditions: Conditions, out: Path, overrides: list[str]
    ) -> dict[str, Any]:
        asked.append(case.name)
        wrong = ["held after 0.30 s"] if case.name == "nan-0001" else []
        facts = {"source": "left_arm", "start": 1.0, "held_after": 0.2, "speed": 0.5, "torque": 0.1}
        stated = asdict(REACTIONS[case.kind].at(conditions.fault_rate))
        facts |= {"rate": conditions.fault_rate, "within": stated["within"]}
        return {"case": asdict(case), "summary": {**facts, "wrong": wrong}}

    monkeypatch.setattr(bench, "run", noted)
    monkeypatch.setattr(bench, "available", lambda: True)
    file = tmp_path / "results.json"
    words = ["--only", "faults", "--kinds", "nan,push", "--json", str(file)]
    assert main([*words, "--seeds", "0"]) == 0
    assert main([*words, "--seeds", "0-1"]) == 1
    assert asked == ["nan-0000", "push-0000", "nan-0001", "push-0001"]
    capsys.readouterr()
    monkeypatch.setattr(bench, "available", lambda: False)
    assert main([*words, "--seeds", "0-1", "--kept"]) == 1
    told = capsys.readouterr().out
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in told.splitlines()]
    assert ["nan", "1.00", "1 of 2", "0.250", "0.200", "0.500", "0.100"] in rows
    assert ["push", "1.00", "2 of 2", "–", "–", "0.500", "0.100"] in rows
    assert ["nan-0001", "held after 0.30 s"] in rows


def test_what_cannot_be_believed_is_a_part_of_its_own(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []

    def noted(
        case: Case, conditions: Conditions, out: Path, overrides: list[str]
    ) -> dict[str, Any]:
        asked.append(case.kind)
        return {"case": asdict(case), "problem": "not tried"}

    monkeypatch.setattr(bench, "run", noted)
    monkeypatch.setattr(bench, "available", lambda: True)
    main(["--only", "beliefs", "--seeds", "0"])
    assert asked == list(BELIEFS)
    # what the lab plays of estimates is all among them
    assert set(WRONG_POINTS) <= set(asked) <= set(KINDS)
    assert len([k for k in asked if BELIEFS[k].within is not None]) >= 12
    asked.clear()
    main(["--only", "faults,beliefs", "--kinds", "person_mm", "--seeds", "0"])
    assert asked == ["person_mm"]
    asked.clear()
    main(["--only", "faults", "--seeds", "0"])
    assert asked == list(FAULTS)


@pytest.mark.parametrize(
    ("events", "kind", "wrong"),
    [
        (["person: coordinates are in mm: …", "arms hold", "arms may move"], "person_mm", []),
        (["person: coordinates are in mm: …", "arms hold"], "person_mm", ["do not move on"]),
        (["person: not finite", "arms hold", "arms may move"], "person_mm", ["does not tell"]),
        ([], "person_mm", ["does not tell", "do not hold", "do not move on"]),
        (
            ["left arm: robot_mode is 0 (kOther), …", "arms hold", "arms may move"],
            "mode_unknown",
            [],
        ),
        (["left arm: joint 1 moved 0.299 rad in 0.005 s", "arms hold"], "joint_leap", []),
        (["left arm: joint 1 moved 0.199 rad", "arms hold"], "joint_leap", ["does not tell"]),
        (["person: a repeated or late message is dropped"], "reordered", []),
        (["a repeated or late message is dropped", "arms hold"], "reordered", ["arms hold"]),
    ],
)
def test_a_log_that_tells_too_little_or_holds_is_wrong(
    events: list[str], kind: str, wrong: list[str]
) -> None:
    lines = [f"{0.1 * k:.3f} {line}" for k, line in enumerate(["arms may move", *events])]
    found = untold(lines, BELIEFS[kind])
    assert len(found) == len(wrong)
    assert all(w in f for w, f in zip(wrong, found, strict=True))


def test_what_waits_by_the_wall_clock_takes_less_of_a_slower_one() -> None:
    assert REACTIONS["stale_estimate"].at(1.0) == REACTIONS["stale_estimate"]
    slower = REACTIONS["stale_estimate"].at(0.5)
    assert slower.within == pytest.approx(0.45 - 0.5 * 0.2)
    assert REACTIONS["nan"].at(0.5).within == REACTIONS["nan"].within
    assert REACTIONS["push"].at(0.5).within is None


@needs_network
def test_what_cannot_begin_is_told_as_what_it_is(tmp_path: Path) -> None:
    conditions = Conditions(SCENARIO, rate=1.0, fault_rate=1.0, minutes=2000.0)
    found = run(Case("soak"), conditions, tmp_path)
    assert "summary" not in found
    assert found["problem"].startswith("the lab did not begin: ")
    assert "duration: is 120000.0, expected" in found["problem"]


def test_memory_that_grows_is_found_in_noise() -> None:
    seconds = np.arange(1200)
    noise = np.random.default_rng(3).normal(0.0, 0.5, len(seconds))
    for rate in (0.0, 20.0):
        # loading comes first, closing last
        memory = 200.0 + rate * seconds / 3600.0 + noise - 100.0 * (seconds < 60)
        memory[-3:] = [np.nan, 20.0, 0.0]
        found = growth(list(memory))
        assert abs(found["per_hour"] - rate) < 0.6
        assert 168.0 * found["per_hour"] < found["week_at_most"]
        assert 168.0 * rate < found["week_at_most"] < 168.0 * (rate + 1.2)
