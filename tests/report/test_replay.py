"""The replay in Meshcat follows its slider."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.report.log import RunLog
from drake_dress.report.replay import MeshcatReplay, show_replay
from tests.report import synthetic


@pytest.fixture
def path(tmp_path: Path) -> Path:
    garment = synthetic.coat(0.06)
    return synthetic.write(tmp_path / "run.h5", garment, synthetic.dressing(garment, count=5))


def test_slider_chooses_the_sample(path: Path) -> None:
    meshcat = Meshcat(MeshcatParams(host="localhost"))
    with RunLog.open(path) as log:
        replay = MeshcatReplay(meshcat, log)
        assert not replay.stopped
        assert (replay.sample, replay.scene.label) == (0, "left: prepare   right: prepare")
        assert _draws(meshcat, log.garment_position(0))
        meshcat.SetSliderValue("Time (s)", 10.0)
        replay.update()
        assert (replay.sample, replay.scene.label) == (4, "left: done   right: done")
        assert _draws(meshcat, log.garment_position(4))
        assert not _draws(meshcat, log.garment_position(0))


def test_forecasts_are_drawn_where_there_are_some(tmp_path: Path, path: Path) -> None:
    garment = synthetic.coat(0.06)
    samples = synthetic.foreseen(synthetic.dressing(garment, count=5))
    foreseen = synthetic.write(tmp_path / "foreseen.h5", garment, samples)
    name = "dressing/forecast/left/2/region"
    for file, drawn in ((path, False), (foreseen, True)):
        meshcat = Meshcat(MeshcatParams(host="localhost"))
        with RunLog.open(file) as log:
            MeshcatReplay(meshcat, log)
            assert meshcat.HasPath(name) == drawn
            if drawn:
                # a ball about the place that is foreseen, as large as the radius
                expected = np.diag([*[np.linspace(0.05, 0.1, 6)[2]] * 3, 1.0])
                expected[:3, 3] = log.joint_position[0, 2] + [0.0, 0.0, 0.1]
                np.testing.assert_allclose(_transform(meshcat, name), expected)


def _transform(meshcat: Meshcat, path: str) -> FloatArray:
    """Returns the last transform (4,4) that Meshcat sent."""
    # at the end of the message: 16 numbers, each after a byte that says its type, by columns
    numbers = np.frombuffer(
        meshcat._GetPackedTransform(path)[-16 * 9 :], dtype=[("kind", "u1"), ("value", ">f8")]
    )
    matrix: FloatArray = numbers["value"].reshape(4, 4).T
    return matrix


def _draws(meshcat: Meshcat, position: FloatArray) -> bool:
    # Meshcat sends vertices as float32.
    packed = meshcat._GetPackedObject("dressing/garment/outside")
    return position.astype("<f4").tobytes() in packed


def test_interrupt_ends_the_replay_well(path: Path) -> None:
    root = Path(__file__).resolve().parents[2]
    script = (
        "import sys; from drake_dress.report.replay import show_replay;"
        f"sys.exit(show_replay({str(path)!r}))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, cwd=root
    )
    assert process.stdout is not None
    assert "http://localhost:" in process.stdout.readline()
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=20) == 0
    process.stdout.close()


def test_missing_log_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError):
        show_replay(tmp_path / "absent.h5")
