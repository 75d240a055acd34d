"""Whole dressings: drawn persons and motions, and what becomes of a run's log."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drake_dress.diagrams.scenario import load_scenario
from drake_dress.errors import FailedError
from drake_dress.interrupt import Interrupt
from drake_dress.learning.motion import dressings
from drake_dress.learning.motion.dressings import (
    Dressing,
    draw_motions,
    drawn_dressings,
    run_all,
    run_dressing,
    sequence_of,
)
from drake_dress.learning.motion.making import Workplace
from drake_dress.learning.motion.motion_file import MotionFile
from drake_dress.learning.motion.sequence import is_moving
from drake_dress.models.dressing.sleeve import loop_orientation, sleeve_state
from drake_dress.models.garment.coat import body_of_size
from drake_dress.report.log import RunLog
from tests.report.synthetic import coat, dressing, write

COAT = coat(0.06)
ACTIVE = Dressing(2, "active", 1234)


def write_run(path: Path, count: int = 21, duration: float = 1.0) -> Path:
    return write(path, COAT, dressing(COAT, count, duration))


def test_persons_come_in_turn_and_seeds_are_those_for_reporting() -> None:
    drawn = drawn_dressings(9, 0)
    assert [d.person for d in drawn[:5]] == [
        "passive_standing",
        "passive_sitting",
        "active",
        "active",
        "passive_standing",
    ]
    assert all(d.seed >= 1000 for d in drawn)
    assert drawn_dressings(4, 0) == drawn[:4]
    assert drawn_dressings(4, 1) != drawn[:4]
    assert len({d.name for d in drawn}) == 9


@pytest.mark.parametrize("run", [*drawn_dressings(4, 3), ACTIVE], ids=lambda run: run.name)
def test_settings_are_those_of_a_scenario(run: Dressing) -> None:
    scenario = load_scenario(run.scenario, run.settings(), run.seed)
    assert scenario.plant.fidelity == "quick"
    assert scenario.log.rate == 20.0
    assert scenario.variation.coat_measures > 0.0
    body, coat = scenario.person.body, scenario.garment.coat
    assert body is not None
    assert coat.size_table == ("women" if body.sex == "female" else "men")
    # the trunk's ellipse is narrower than a tape around the chest
    ellipse = np.pi * (scenario.person.measures.chest_width + scenario.person.measures.chest_depth)
    assert coat.size is not None
    assert 0.0 <= body_of_size(coat.size_table, coat.size).chest - 0.5 * ellipse < 0.35
    assert scenario.variation.arm_angle_deg > 0.0
    behaviour = scenario.person.behaviour
    assert behaviour.kind == ("active" if run.person == "active" else "passive")
    assert (scenario.person.posture == "sitting") == (run.person == "passive_sitting")
    if run.person == "active":
        reach = behaviour.motions[0].reach
        assert reach is not None
        assert reach.side == "both"


def test_an_active_person_always_reaches_and_does_each_other_motion_in_half_of_the_runs() -> None:
    drawn = [draw_motions(seed) for seed in range(1000, 1100)]
    assert drawn[0] == draw_motions(1000)
    for name in ("turn", "withdraw", "wave"):
        often = sum(any(name in motion for motion in motions) for motions in drawn)
        # half of 100, outside this range once in 10,000 roots
        assert 30 <= often <= 70
    for motions in drawn:
        assert "reach" in motions[0]
        assert 0.2 <= motions[0]["reach"]["within"] <= 0.3
        for motion in motions[1:]:
            for name, keys in motion.items():
                assert 3.0 <= keys["start"] <= 25.0
                if name == "turn":
                    assert 5.0 <= abs(keys["angle_deg"]) <= 30.0


@pytest.mark.parametrize("seed", range(1000, 1012))
def test_every_drawn_motion_is_one_that_a_person_can_make(seed: int) -> None:
    # a wave that is too fast for the hand would be refused
    setting = f"person.behaviour.motions={json.dumps(draw_motions(seed))}"
    assert load_scenario(ACTIVE.scenario, [setting]).person.behaviour.motions


def test_a_sequence_has_the_true_joints_armholes_and_flags_of_the_log(tmp_path: Path) -> None:
    with RunLog.open(write_run(tmp_path / "run.h5")) as log:
        sequence = sequence_of(log)
        np.testing.assert_array_equal(sequence.joints, log.joint_position)
        moving = is_moving(log.joint_position[:, [2, 5]])
        assert log.intent is not None
        assert (log.intent > 0)[~moving].any()
        np.testing.assert_array_equal(sequence.intent, np.where(moving, log.intent, 0))
        for k in (0, 20):
            for i, side in enumerate(("left", "right")):
                sign = loop_orientation(log, side)
                state = sleeve_state(log.garment_position(k), log.loops[f"{side}_armhole"], sign)
                expected = [*state.p_c, *state.v_c]
                np.testing.assert_array_equal(sequence.sleeves[k, i], expected)
    # the coat comes from behind and ends on the arms
    assert not sequence.on[0].any()
    assert sequence.on[-1].all()


def test_a_garment_that_is_not_finite_has_no_sleeves(tmp_path: Path) -> None:
    samples = dressing(COAT, 3, 0.1)
    broken = np.full_like(np.asarray(samples[2].garment_position), np.nan)
    samples[2] = replace(samples[2], garment_position=broken)
    with RunLog.open(write(tmp_path / "run.h5", COAT, samples)) as log:
        sequence = sequence_of(log)
    assert np.isfinite(sequence.sleeves[:2]).all()
    assert np.isnan(sequence.sleeves[2]).all()
    assert not sequence.on[2].any()


def test_a_log_at_another_rate_is_refused(tmp_path: Path) -> None:
    with RunLog.open(write_run(tmp_path / "run.h5", 31)) as log:
        with pytest.raises(FailedError, match="expected a log at 20 Hz"):
            sequence_of(log)


def fake(monkeypatch: pytest.MonkeyPatch, status: int, errors: str = "") -> list[list[str]]:
    """Lets runs end with a status, and a made-up log if they succeed; returns their commands."""
    commands: list[list[str]] = []

    def executed(command: list[str], stop: Interrupt | None) -> tuple[int, str]:
        commands.append(command)
        out = Path(command[command.index("--out") + 1])
        if status in (0, 1):
            out.mkdir(exist_ok=True)
            write_run(out / "run.h5")
            summary = {"success": status == 0, "reason": "it slipped" if status else None}
            (out / "summary.json").write_text(json.dumps(summary))
        return status, errors

    monkeypatch.setattr(dressings, "_executed", executed)
    return commands


def test_a_run_becomes_a_file_of_one_sequence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    commands = fake(monkeypatch, 1)
    content = run_dressing(ACTIVE, tmp_path, set_seed=9)
    assert content is not None
    assert (content.origin.kind, content.origin.seed, content.origin.first) == ("dressing", 9, 2)
    assert content.data.joint_position.shape == (1, 21, 6, 3)
    assert content.notes["person"] == "active"
    assert content.notes["run_seed"] == 1234
    assert content.notes["dressed"] is False
    assert content.notes["reason"] == "it slipped"
    assert "seed: 3" in content.notes["scenario"]
    (command,) = commands
    for word in ("--no-meshcat", "--no-report", "--one-process", "1234"):
        assert word in command


def test_a_run_without_result_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake(monkeypatch, 2, "first\ndrake-dress: no such key\n")
    with pytest.raises(FailedError, match="status 2: drake-dress: no such key"):
        run_dressing(ACTIVE, tmp_path, 0)


def test_each_dressing_is_run_once(monkeypatch: pytest.MonkeyPatch) -> None:
    commands = fake(monkeypatch, 0)
    wanted = drawn_dressings(5, 0)
    done = dict(run_all(wanted, 0, Workplace(2), Interrupt()))
    assert set(done) == set(wanted)
    assert len(commands) == 5


def test_a_cluster_runs_each_dressing_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    commands = fake(monkeypatch, 0)

    def cluster(
        address: str,
        run: Callable[[Dressing, Path], MotionFile],
        cases: Sequence[Dressing],
        stop: Interrupt,
        command: str,
    ) -> Iterator[tuple[Dressing, MotionFile]]:
        for case in cases:
            yield case, run(case, tmp_path / case.name)

    monkeypatch.setattr(dressings, "completed_on", cluster)
    wanted = drawn_dressings(2, 0)
    done = dict(run_all(wanted, 0, Workplace(2, "auto"), Interrupt()))
    assert [done[w].origin.first for w in wanted] == [0, 1]
    assert len(commands) == 2


def test_a_signal_ends_runs_that_are_under_way(monkeypatch: pytest.MonkeyPatch) -> None:
    stop = Interrupt()
    stop.set()
    status, _ = dressings._executed(["sleep", "60"], stop)
    assert status == -15
    fake(monkeypatch, -15)
    assert not list(run_all([ACTIVE], 0, Workplace(1), stop))
