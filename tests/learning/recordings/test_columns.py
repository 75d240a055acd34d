"""Joints and time are found in the headers that other programs write."""

from pathlib import Path

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.learning.recordings.columns import columns_of, read_table

JOINTS = ("shoulder", "elbow", "hand")
PATH = Path("some.csv")


def header(pattern: str, sides: tuple[str, ...], joints: tuple[str, ...] = JOINTS) -> list[str]:
    return [pattern.format(side=s, joint=j, axis=a) for s in sides for j in joints for a in "xyz"]


@pytest.mark.parametrize(
    ("pattern", "sides", "joints"),
    [
        ("{side}_{joint}_{axis}", ("left", "right"), JOINTS),
        ("{side} {joint} {axis}", ("Left", "Right"), ("Shoulder", "Elbow", "Wrist")),
        ("{side}{joint}.{axis}", ("L", "R"), ("Shoulder", "Elbow", "Wrist")),
        ("{joint}{side}_{axis}", ("Left", "Right"), ("Shoulder", "Elbow", "Wrist")),
        ("{side}{joint}_{axis}", ("l", "r"), ("shoulder", "elbow", "wrist")),
        ("{side}{joint}:{axis}", ("L", "R"), ("SHO", "ELB", "WRI")),
        ("{side}-{joint}-{axis}", ("left", "right"), JOINTS),
    ],
)
def test_names_of_other_programs_are_understood(
    pattern: str, sides: tuple[str, ...], joints: tuple[str, ...]
) -> None:
    names = ["time", *header(pattern, sides, joints)]
    found = columns_of(PATH, names)
    assert found.time == 0
    assert len(found.points) == 18
    # in this order of the header, column k + 1 is joint k // 3 and axis k % 3
    assert all(found.points[k // 3, k % 3] == k + 1 for k in range(18))


def test_hand_is_preferred_to_wrist_and_other_columns_are_left_alone() -> None:
    names = ["frame", *header("right_{joint}_{axis}", ("",), ("shoulder", "elbow", "wrist"))]
    names += ["right_hand_x", "right_hand_y", "right_hand_z", "right_knee_x", "head_x", "grip"]
    found = columns_of(PATH, names)
    assert [names[found.points[5, axis]] for axis in range(3)] == names[10:13]
    assert found.time is None
    assert len(found.points) == 9


@pytest.mark.parametrize(("name", "unit"), [("time", 1.0), ("t", 1.0), ("time (ms)", 1e-3)])
def test_time_is_found_with_its_unit(name: str, unit: float) -> None:
    found = columns_of(PATH, [name, *header("{side}_{joint}_{axis}", ("right",))])
    assert (found.time, found.time_unit) == (0, unit)


def test_header_without_a_whole_arm_is_refused() -> None:
    names = ["time", *header("{side}_{joint}_{axis}", ("left",))[:-1]]
    with pytest.raises(UserError, match=r"some.csv: header: names no arm in full"):
        columns_of(PATH, names)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " "])
def test_tables_with_any_delimiter_are_read(tmp_path: Path, delimiter: str) -> None:
    path = tmp_path / "table.txt"
    rows = [["a", "b", "c"], ["1", "2.5", "nan"], ["-3", "4e-1", "5"]]
    path.write_text("# made by hand\n" + "\n".join(delimiter.join(r) for r in rows) + "\n")
    names, numbers = read_table(path)
    assert names == ["a", "b", "c"]
    np.testing.assert_array_equal(numbers, [[1.0, 2.5, np.nan], [-3.0, 0.4, 5.0]])


def test_empty_cells_are_missing_and_words_are_named(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("a,b\n1,\n,2\n")
    np.testing.assert_array_equal(read_table(path)[1], [[1.0, np.nan], [np.nan, 2.0]])
    path.write_text("a,b\n1,2\n3,four\n")
    with pytest.raises(UserError, match=r"row 3, b: is 'four', expected a number"):
        read_table(path)
    path.write_text("a,b\n1,2,3\n")
    with pytest.raises(UserError, match=r"row 2: has 3 cells, expected 2"):
        read_table(path)
    path.write_text("a,b\n")
    with pytest.raises(UserError, match=r"is empty"):
        read_table(path)
