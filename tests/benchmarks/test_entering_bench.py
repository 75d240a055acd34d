"""The benchmark that tells whether it is foreseen that a hand goes in."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks import entering
from benchmarks.entering import Ahead, Entry, table


def entry(really: bool, moving: bool, staying: bool, off: float) -> Entry:
    """Foreseen `off` m from where it was past arms that move, twice that past arms that stay."""
    there, way = np.array([0.3, -0.1, 1.0]), np.array([0.6, 0.8, 0.0])
    return Entry(
        Ahead(really, there),
        Ahead(moving, there + off * way),
        Ahead(staying, there - 2.0 * off * way),
    )


def test_hands_that_are_in_and_others_are_counted_apart() -> None:
    found = [entry(True, True, True, 0.01)] * 3 + [entry(True, True, False, 0.02)]
    found += [entry(False, False, True, 0.03)] * 2 + [entry(False, True, True, 0.04)]
    moved, stayed = table(found).rows
    assert moved[1:3] == ["4 of 4", "1 of 3"]
    assert moved[3] == pytest.approx(20.0)
    assert stayed[1:3] == ["3 of 4", "3 of 3"]
    assert stayed[3] == pytest.approx(40.0)


def test_no_moment_is_a_table_without_figures() -> None:
    for row in table([]).rows:
        assert row[1:] == ["0 of 0", "0 of 0", None]


def test_a_log_that_is_none_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert entering.main([str(tmp_path / "run.h5")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
