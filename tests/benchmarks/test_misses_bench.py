"""The benchmark that tells how often hands are missed before they are in."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks import misses
from benchmarks.misses import Hand, Look, hands, table

NONE, LEFT, RIGHT, BOTH = (False, False), (True, False), (False, True), (True, True)


@pytest.mark.parametrize("mirrored", [False, True])
def test_misses_of_the_second_hand_count_from_when_the_first_one_is_in(mirrored: bool) -> None:
    course = [(NONE, (0, 0)), (NONE, (2, 0)), (LEFT, (2, 0)), (LEFT, (2, 3)), (BOTH, (2, 3))]
    if mirrored:
        course = [(linked[::-1], attempts[::-1]) for linked, attempts in course]
    looks = [Look(linked, attempts) for linked, attempts in course]
    assert hands(looks) == [Hand(False, 2, True), Hand(True, 3, True)]
    assert hands(looks[:4]) == [Hand(False, 2, True), Hand(True, 3, False)]
    assert hands(looks[:2]) == [Hand(False, 2, False)]


def test_misses_of_hands_that_change_places_count() -> None:
    looks = [Look(LEFT, (0, 0)), Look(LEFT, (0, 2)), Look(RIGHT, (1, 2)), Look(RIGHT, (4, 2))]
    assert hands(looks) == [Hand(False, 0, True), Hand(True, 6, False)]


def test_shares_are_of_those_that_came_to_so_many_misses() -> None:
    """Who had not gone in when the run ended was not tried once more after its last miss."""
    found = [Hand(True, k, True) for k in (0, 2, 2, 7)] + [Hand(True, 8, False)]
    found += [Hand(False, 1, True), Hand(False, 0, False)]
    rows = {row[0]: row[1:] for row in table(found).rows}
    assert rows["0"] == ["0 of 1", "1 of 5"]
    assert rows["1"] == ["1 of 1", "0 of 4"]
    assert rows["2"] == ["–", "2 of 4"]
    assert rows["5"] == ["–", "0 of 2"]
    # 6 and 7 of both, of which one went in after the seventh
    assert rows["6 and more"] == ["–", "1 of 4"]


def test_a_log_that_is_none_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert misses.main([str(tmp_path / "run.h5")]) == 2
    assert "no such file" in capsys.readouterr().err
