"""Lab and run in two processes, with a network of their own, and faults in between."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.hardware.__main__ import main
from benchmarks.hardware.faults import REACTIONS, FaultCase, run_case
from benchmarks.hardware.two_processes import Plan, available, memory_of, play
from drake_dress.errors import UserError
from drake_dress.report.log import RunLog
from drake_dress.report.summary import summarize

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
        assert log.estimated and log.ended_by is None
        assert log.time[-1] > 3.5
        summary = summarize(log, wall_time=0.0)
        assert summary["command_rate_hz"] > 100.0
        assert summary["start_up_s"] > 0.0
        assert summary["fell_behind_s"] >= 0.0
        travelled = np.linalg.norm(np.diff(log.gripper_position["left"][5:], axis=0), axis=1)
        assert travelled.sum() > 0.05
    with RunLog.open(tmp_path / "lab" / "run.h5") as log:
        assert not log.estimated
        assert "holds, ended" in log.events[-1]


@needs_network
@pytest.mark.parametrize("kind", ["killed", "disk_full", "random"])
def test_a_fault_is_answered_as_stated(kind: str, tmp_path: Path) -> None:
    seed = int(np.random.SeedSequence().generate_state(1)[0])
    if kind == "random":
        kind = str(np.random.default_rng(seed).choice(list(REACTIONS)))
    print(f"kind {kind}, seed {seed}")
    result = run_case(FaultCase(kind, seed), SCENARIO, tmp_path, rate=0.5)
    assert result["wrong"] == []


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


@pytest.mark.parametrize("words", [["--only", "nonsense"], ["--kinds", "nonsense"]])
def test_a_part_that_there_is_not_is_told(words: list[str]) -> None:
    with pytest.raises(UserError, match="nonsense"):
        main(words)
