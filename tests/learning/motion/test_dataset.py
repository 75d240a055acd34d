"""A set is split without overlap, and only whole files of it are read."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.learning.motion.dataset import (
    DRESSING,
    INDEX,
    PARTS,
    PER_FILE,
    MotionSet,
    Part,
    file_name,
    part_range,
    read_dressings,
    read_index,
    read_kind,
    read_motion,
)
from drake_dress.learning.motion.motion_file import MotionArrays, MotionFile, Origin, write_motion
from drake_dress.learning.motion.sequence import KINDS, Kind
from tests.learning.motion.persons import made_up

LENGTH = 3
KNOWN = MotionSet(5, "1.0", {"passive": 120, "active": 60, "free": 0}, ("dressing-active-7.h5",))
ALL = {"passive": made_up(120, LENGTH, 1), "active": made_up(60, LENGTH, 2)}


def rows(of: MotionArrays, part: slice) -> MotionArrays:
    return MotionArrays(*(array[part] for array in of.arrays().values()))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    kinds: tuple[Kind, ...] = ("passive", "active")
    for kind in kinds:
        for first in range(0, KNOWN.counts[kind], PER_FILE):
            content = rows(ALL[kind], slice(first, first + PER_FILE))
            write_motion(
                tmp_path / file_name(kind, first),
                MotionFile(KNOWN.origin(kind, first), content, {}),
            )
    of_run = MotionFile(Origin(DRESSING, 5, 0, "1.0"), made_up(1, 9), {"person": "active"})
    write_motion(tmp_path / KNOWN.dressings[0], of_run)
    KNOWN.write(tmp_path)
    return tmp_path


@given(st.integers(0, 5000))
def test_parts_are_disjoint_and_cover_all(count: int) -> None:
    numbers = [n for part in PARTS for n in part_range(part, count)]
    assert numbers == list(range(count))
    # the last 15 % are the test, the 10 % before them the validation
    assert abs(len(part_range("test", count)) - 0.15 * count) <= 0.5
    assert abs(len(part_range("validation", count)) - 0.10 * count) <= 0.5


def test_the_index_tells_what_was_written(folder: Path) -> None:
    assert read_index(folder) == KNOWN


@pytest.mark.parametrize("part", PARTS)
def test_a_part_has_its_sequences_and_no_others(part: Part, folder: Path) -> None:
    data = read_motion(folder, part=part)
    assert len(data) == sum(len(part_range(part, n)) for n in (120, 60))
    assert data.time.tolist() == [0.0, 0.05, 0.1]
    for k in range(len(data)):
        kind, number = KINDS[data.kind[k]], data.number[k]
        assert number in part_range(part, KNOWN.counts[kind])
        for name, array in ALL[kind].arrays().items():
            np.testing.assert_array_equal(getattr(data, name)[k], array[number])


def test_kinds_are_chosen(folder: Path) -> None:
    data = read_motion(folder, ["active"], "test")
    assert data.number.tolist() == list(range(51, 60))
    assert set(data.kind.tolist()) == {KINDS.index("active")}
    whole = read_kind(folder, KNOWN, "passive")
    np.testing.assert_array_equal(whole.sleeve, ALL["passive"].sleeve)


def test_a_part_without_sequences_is_told(folder: Path) -> None:
    with pytest.raises(UserError, match="has no sequence for test of free"):
        read_motion(folder, ["free"], "test")


def test_dressings_are_read_whole(folder: Path) -> None:
    (run,) = read_dressings(folder)
    assert run.notes["person"] == "active"
    assert run.data.joint_position.shape == (1, 9, 6, 3)


def test_a_missing_file_is_named(folder: Path) -> None:
    (folder / file_name("passive", 50)).unlink()
    with pytest.raises(UserError, match=r"motion-passive-00050\.h5: no such file"):
        read_motion(folder)
    # the others do not need it
    assert len(read_motion(folder, ["active"]))


def test_a_damaged_file_is_named(folder: Path) -> None:
    path = folder / file_name("active", 0)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(UserError, match=r"motion-active-00000\.h5: is cut short"):
        read_motion(folder)


@pytest.mark.parametrize(
    "other",
    [{"seed": 6}, {"version": "0.9"}, {"first": 50}, {"kind": "active"}],
    ids=lambda other: next(iter(other)),
)
def test_a_file_of_another_set_is_named(other: dict[str, object], folder: Path) -> None:
    origin = replace(KNOWN.origin("passive", 0), **other)  # type: ignore[arg-type]
    write_motion(folder / file_name("passive", 0), MotionFile(origin, made_up(50, LENGTH), {}))
    key = next(iter(other))
    with pytest.raises(UserError, match=f"motion-passive-00000.h5: {key}: is .*, expected"):
        read_motion(folder)


def test_a_file_with_too_few_sequences_is_named(folder: Path) -> None:
    content = MotionFile(KNOWN.origin("passive", 0), made_up(20, LENGTH), {})
    write_motion(folder / file_name("passive", 0), content)
    with pytest.raises(UserError, match="has 20 sequences, expected 50 or more"):
        read_motion(folder)


def test_a_set_that_is_not_complete_cannot_be_read(folder: Path) -> None:
    (folder / INDEX).unlink()
    with pytest.raises(UserError, match="expected a complete set"):
        read_motion(folder)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"schema": "x"}', '{"schema": 1, "seed": []}'])
def test_an_index_that_is_none_is_told(text: str, folder: Path) -> None:
    (folder / INDEX).write_text(text)
    with pytest.raises(UserError, match=INDEX):
        read_motion(folder)
    said = json.loads(json.dumps({"schema": "drake_dress.motion/1", "seed": "x"}))
    (folder / INDEX).write_text(json.dumps(said))
    with pytest.raises(UserError, match="cannot be used"):
        read_motion(folder)
