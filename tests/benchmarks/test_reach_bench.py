"""The benchmark that tells how far arms at a placement fall behind grippers that floated."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.logged import opened
from drake_dress.report.log import RunLog

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks import reach
from benchmarks.reach import Recorded, follow, recorded, table
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.scenario.schema import Arms
from drake_dress.errors import UserError
from tests.report import synthetic

_SCENARIO = Path(__file__).parents[2] / "scenarios" / "dummy_standing.yaml"
# Behind the person, a shoulder's width apart, where a coat is held up.
_BEGIN = np.array([[-0.3, 0.22, 1.35], [-0.3, -0.22, 1.35]])


def run(travel: np.ndarray) -> Recorded:
    """Returns grippers that move from where they begin, with the person out of the way.

    Args:
        travel: (T,3) m, of both grippers.
    """
    grippers = _BEGIN + travel[:, None]
    count = len(travel)
    far = np.broadcast_to([[5.0, 0.0, 1.0]], (count, 1, 3))
    return Recorded(
        "made-up",
        grippers,
        np.gradient(grippers, reach._STEP, axis=0),
        far,
        far + [0.0, 0.0, 0.5],
        np.array([0.1]),
        load_scenario(_SCENARIO),
    )


def forward(speed: float, duration: float) -> np.ndarray:
    """Returns travel (T,3) along x, which begins and ends at rest."""
    time = np.arange(0.0, duration, reach._STEP)
    share = time / time[-1]
    return np.outer(speed * duration * (share - np.sin(2 * np.pi * share) / (2 * np.pi)), [1, 0, 0])


def test_arms_keep_up_with_slow_grippers() -> None:
    """They are behind by less than what the grippers travel in a step, twice 8 cm/s at most."""
    done = follow(run(forward(0.08, 3.0)), Arms("panda"))
    assert done.lag.max() < 0.16 * reach._STEP
    assert done.lag[-1].max() < 1e-3
    assert done.between > 0.06
    assert done.to_person > 1.0


def test_arms_are_behind_grippers_that_leap_by_what_they_cannot_do_at_once() -> None:
    """Within a step of 20 ms an arm at 1.7 m/s, a Panda's fastest, goes 3.4 cm of 30."""
    travel = np.zeros((100, 3))
    travel[50:, 0] = 0.3
    lag = follow(run(travel), Arms("panda")).lag.max(axis=1)
    assert lag[:50].max() < 2e-3
    assert 0.26 < lag[50] < 0.301
    assert lag[50:].max() == pytest.approx(lag[50], abs=0.02)
    assert lag[-1] < 0.02


def test_arms_are_behind_where_they_do_not_reach() -> None:
    """No arm gets a gripper further from its base than 1.3 m; 0.6 m ahead it is 1.5 m away."""
    travel = forward(0.2, 3.0)
    behind = Arms("panda", distance_behind=0.7)
    lag = follow(run(np.concatenate([travel, np.tile(travel[-1], (50, 1))])), behind).lag
    away = np.linalg.norm(_BEGIN[0] + travel[-1] - [-0.7, 0.55, 1.4 + behind.height_offset])
    assert lag[-1].min() > away - 1.3


def test_placements_that_do_not_reach_the_beginning_are_told_in_the_table() -> None:
    runs = [run(forward(0.08, 1.0))]
    near, far = table(runs, [Arms("panda"), Arms("panda", distance_behind=2.0)]).rows
    assert near[0].startswith("0.7 behind, 1.1 apart, -0.25 high, 35°")
    assert near[1] <= near[3] < 3.2
    assert near[2] == 0.0
    assert near[4] == "made-up"
    assert far[1:4] == [None] * 3
    assert "short" in far[4]


def test_what_a_log_holds_is_read_at_even_times(tmp_path: Path) -> None:
    garment = synthetic.coat()
    samples = synthetic.dressing(garment, count=11, duration=1.0)
    log = synthetic.write(tmp_path / "run.h5", garment, samples)
    (known,) = [recorded(path, log) for path, log in opened([log])]
    assert len(known.grippers) == 50
    first = np.stack([samples[0].gripper_position[side] for side in ("left", "right")])
    second = np.stack([samples[1].gripper_position[side] for side in ("left", "right")])
    np.testing.assert_allclose(known.grippers[2], first + 0.4 * (second - first), atol=1e-5)
    np.testing.assert_allclose(known.velocity[2], (second - first) / 0.1, atol=1e-4)
    np.testing.assert_allclose(known.person(7).first, np.asarray(samples[0].capsule_a), atol=1e-6)


def test_logs_of_arms_are_refused(tmp_path: Path) -> None:
    text = _SCENARIO.read_text() + "\nstation: {arms: {model: panda}}\n"
    garment = synthetic.coat()
    path = synthetic.write(tmp_path / "run.h5", garment, [], scenario=text)
    with RunLog.open(path) as log, pytest.raises(UserError, match="expected floating"):
        recorded(path, log)


def test_a_log_that_is_none_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        reach.main([str(tmp_path / "run.h5")])


def test_placements_that_are_no_numbers_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        reach.main(["run.h5", "--behind", "near"])
    assert caught.value.code == 2
    assert "'near' are no numbers" in capsys.readouterr().err
