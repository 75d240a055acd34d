"""The benchmark that tells what lets a hand into its armhole."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks import hands
from benchmarks.hands import Moment, quantities, tables
from drake_dress.models.dressing.sleeve import SleeveState
from tests.report import synthetic


def moment(value: float, wait: float | None, second: bool, touches: bool = False) -> Moment:
    return Moment("run", 1.0, "left", second, wait, touches, {"way, cm": value})


def test_shares_by_sixths_are_those_that_were_made() -> None:
    """The hand goes in within 3 s wherever the quantity is low, whatever the order of moments."""
    rng = np.random.default_rng(0)
    values = rng.permutation(60).astype(float)
    found = [moment(v, 2.0 if v < 20 else 4.0 if v < 40 else None, True) for v in values]
    (table,) = tables(found, 3.0)
    assert table.title == "Second hand: goes in within 3 s: 20 of 60 moments"
    (row,) = table.rows
    assert row[0] == "way, cm"
    assert [cell.split(": ")[1] for cell in row[1:]] == ["100 %"] * 2 + ["0 %"] * 4
    assert row[1].startswith("0 to 9:")
    assert row[6].startswith("50 to 59:")


def test_first_and_second_hands_and_touches_are_told_apart() -> None:
    found = [moment(v, 1.0, False) for v in range(6)]
    found += [moment(v, 1.9 if v < 3 else 2.1, True, touches=True) for v in range(6)]
    titles = [table.title for table in tables(found, 3.0)]
    assert titles == [
        "First hand: goes in within 3 s: 6 of 6 moments",
        "Second hand: goes in within 3 s: 6 of 6 moments",
        "Second hand, where it touches: within 2 s: 3 of 6 moments",
    ]


def test_too_few_moments_make_no_table() -> None:
    assert not list(tables([moment(1.0, 1.0, False)], 3.0))


@pytest.mark.parametrize("side", [0, 1])
def test_quantities_of_a_hand_before_its_armhole(side: int) -> None:
    """Person faces +x, so that the left is +y; the forearm rises by 30° and comes from inward."""
    outward = np.array([0.0, 1.0 if side == 0 else -1.0, 0.0])
    hand = np.array([-0.3, 0.0, 0.9]) + 0.3 * outward
    forearm = np.array([np.sqrt(1.0 - 0.5**2 - 0.2**2), 0.0, 0.5]) - 0.2 * outward
    joints = np.zeros((6, 3))
    joints[0], joints[3] = [0.0, 0.2, 1.4], [0.0, -0.2, 1.4]
    joints[3 * side + 2], joints[3 * side + 1] = hand, hand + 0.25 * forearm
    joints[5 - 3 * side] = hand - 0.6 * outward
    normal = np.array([1.0, 0.0, 0.0])
    up = np.array([0.0, 0.0, 1.0])
    mine = SleeveState(hand - 0.1 * normal + 0.03 * up, normal)
    other = SleeveState(mine.p_c - 0.5 * outward, normal)
    sleeves = [mine, other] if side == 0 else [other, mine]
    grippers = [np.zeros(3), np.zeros(3)]
    grippers[side] = np.array([0.0, 0.0, -0.2])
    found = quantities(side, joints, sleeves, grippers, 0.5)
    assert found["hand to the armhole's centre, cm"] == pytest.approx(100 * np.hypot(0.1, 0.03))
    assert found["hand beside the armhole's normal, cm"] == pytest.approx(3.0)
    offset = hand - mine.p_c
    beside = np.linalg.norm(np.cross(offset, forearm))
    assert found["centre beside the forearm's line, cm"] == pytest.approx(100 * beside)
    assert found["normal off the forearm, °"] == pytest.approx(np.rad2deg(np.arccos(forearm[0])))
    assert found["armholes apart, share of rest"] == pytest.approx(1.0)
    assert found["gripper over the other one, cm"] == pytest.approx(-20.0)
    assert found["hands apart, share of armholes at rest"] == pytest.approx(1.2)
    assert found["forearm below level, °"] == pytest.approx(30.0)
    inward = np.rad2deg(np.arcsin(0.2))
    assert found["forearm inward from hand to elbow, °"] == pytest.approx(inward)


def test_a_hand_is_in_where_it_stays_in() -> None:
    time = np.arange(0.0, 3.0, 0.1)
    holds = np.zeros(30, dtype=bool)
    holds[3:6] = holds[10:20] = holds[27:] = True
    stays = hands._stays(time, holds)
    assert not stays[:10].any()
    assert stays[10:20].all()
    assert not stays[20:].any()


def test_a_log_that_is_none_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert hands.main([str(tmp_path / "run.h5")]) == 2
    assert "no such file" in capsys.readouterr().err


def test_moments_of_a_run_are_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The left hand is in after 3 s, the right one after 40 s; a sample a second.

    The left hand is at its armhole meanwhile, so it begins to touch the opening once.
    """
    garment = synthetic.coat()
    armhole = garment.loops["left_armhole"]
    samples = []
    for sample in synthetic.dressing(garment, count=301, duration=300.0):
        joints = np.array(sample.joint_position)
        joints[2] = np.asarray(sample.garment_position)[armhole].mean(axis=0)
        samples.append(replace(sample, joint_position=joints))
    log = synthetic.write(tmp_path / "run.h5", garment, samples)
    kept = tmp_path / "moments.json"
    assert hands.main([str(log), "--json", str(kept)]) == 0
    assert "First hand: goes in within 3 s" in capsys.readouterr().out
    found = json.loads(kept.read_text())
    assert {(m["side"], m["second"]) for m in found} == {("left", False), ("right", True)}
    assert all(m["wait"] == pytest.approx((40 if m["second"] else 3) - m["time"]) for m in found)
    assert [m["side"] for m in found if m["touches"]] == ["left"]
