"""A short, coarse run from YAML to report."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from drake_dress.__main__ import main
from drake_dress.models.control.safety import Verdict
from drake_dress.report.log import RunLog
from tests.present import present

SCENARIO = """# a second of it, coarse
duration: 1.0
plant: {spacing: 0.05, time_step: 0.01}
controller: {spacing: 0.06, global_mpc: {horizon: 3, max_iterations: 2}}
"""
# a wave of the right hand, then a turn, whose limits lie between samples
MOTIONS = """
person:
  behaviour:
    kind: active
    motions:
      - wave: {side: right, start: 0.115, duration: 0.3, amplitude: 0.01}
      - turn: {angle_deg: 3.0, start: 0.715, duration: 0.2}
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[int, Path]:
    folder = tmp_path_factory.mktemp("run")
    path = folder / "short.yaml"
    path.write_text(SCENARIO)
    return main(["run", str(path), "--out", str(folder / "out"), "--no-meshcat"]), folder


def test_run_that_ends_too_early_says_so(run: tuple[int, Path]) -> None:
    status, folder = run
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert status == 1
    assert summary["success"] is False
    assert "sleeve not on" in summary["reason"]
    for name in ("run.h5", "report.html", "replay.html"):
        assert (folder / "out" / name).stat().st_size > 1000


@pytest.fixture(scope="module")
def again(run: tuple[int, Path]) -> Path:
    _, folder = run
    out = folder / "again"
    words = ["--out", str(out), "--no-meshcat", "--no-report"]
    assert main(["run", str(folder / "short.yaml"), *words]) == 1
    return out


def test_a_run_without_report_writes_log_and_summary_alone(
    run: tuple[int, Path], again: Path
) -> None:
    assert {path.name for path in again.iterdir()} == {"run.h5", "summary.json"}
    _, folder = run
    first, second = (json.loads((p / "summary.json").read_text()) for p in (folder / "out", again))
    timed = {key for key in first if first[key] != second[key]}
    assert timed <= {
        "wall_time_s", "realtime_factor", "global_rate_hz", "local_rate_hz",
        "global_solve_ms", "local_solve_ms", "late_plans",
    }  # fmt: skip


def test_same_seed_gives_the_same_numbers(run: tuple[int, Path], again: Path) -> None:
    _, folder = run
    with h5py.File(folder / "out" / "run.h5") as a, h5py.File(again / "run.h5") as b:
        for name in ("garment/position", "gripper/left/force", "human/joint_position"):
            np.testing.assert_array_equal(a[name][()], b[name][()])


def test_log_tells_what_safety_cut(run: tuple[int, Path]) -> None:
    _, folder = run
    with h5py.File(folder / "out" / "run.h5") as log:
        safety = log["control/safety"]
        assert safety.shape == (len(log["time"]), 2)
        assert f"{Verdict.ACCELERATION.value} ACCELERATION" in list(safety.attrs["flags"])
        # the first plan starts at full speed, which grippers cannot do
        assert np.all(np.any(safety[()] & Verdict.ACCELERATION.value, axis=0))
        assert not np.any(safety[()] & (Verdict.INVALID | Verdict.STALE | Verdict.UNMEASURED).value)


def test_log_tells_when_the_person_moves_each_arm(run: tuple[int, Path], tmp_path: Path) -> None:
    """A dummy never does."""
    _, folder = run
    with RunLog.open(folder / "out" / "run.h5") as log:
        np.testing.assert_array_equal(present(log.intent), np.zeros((len(log), 2)))
    path = tmp_path / "active.yaml"
    path.write_text(SCENARIO + MOTIONS)
    words = ["--out", str(tmp_path / "out"), "--no-meshcat", "--no-report"]
    assert main(["run", str(path), *words]) == 1
    with RunLog.open(tmp_path / "out" / "run.h5") as log:
        time, intent = log.time, present(log.intent)
    turning = (time > 0.715) & (time < 0.915)
    np.testing.assert_array_equal(intent[:, 0], turning)
    waving = (time > 0.115) & (time < 0.415)
    assert intent[turning | waving, 1].all()
    assert not intent[time < 0.115].any()
    assert waving.sum() > 5
    assert turning.sum() > 3


def test_interrupt_leaves_a_log_of_what_had_run(tmp_path: Path) -> None:
    path = tmp_path / "long.yaml"
    path.write_text(SCENARIO.replace("1.0", "600.0"))
    command = [sys.executable, "-m", "drake_dress", "run", str(path), "--no-meshcat"]
    process = subprocess.Popen(
        [*command, "--out", str(tmp_path / "out")],
        cwd=Path(__file__).parents[2],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    assert "5.0 s" in process.stderr.readline()
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "interrupted" in output
    with h5py.File(tmp_path / "out" / "run.h5") as log:
        assert log["time"][-1] >= 4.9
        assert len(log["garment/position"]) == len(log["time"])


def test_grippers_carry_the_coat_and_controller_moves_them(run: tuple[int, Path]) -> None:
    _, folder = run
    with h5py.File(folder / "out" / "run.h5") as log:
        left, right = (log[f"gripper/{side}/force"][()] for side in ("left", "right"))
        start, end = log["gripper/left/position"][0], log["gripper/left/position"][-1]
        weight = -(left + right)[:, 2].mean()
    assert 2.0 < weight < 8.0
    assert np.linalg.norm(end - start) > 0.01
