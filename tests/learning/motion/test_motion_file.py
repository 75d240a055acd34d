"""Files of sequences come back as they were written, and damage is named."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.learning.motion.motion_file import (
    SCHEMA,
    MotionArrays,
    MotionFile,
    Origin,
    read_motion_file,
    read_origin,
    write_motion,
)
from drake_dress.learning.motion.sequence import Sequence
from tests.learning.motion.persons import made_up

ORIGIN = Origin("active", 3, 50, "1.2")


def written(folder: Path, name: str = "a.h5") -> Path:
    path = folder / name
    write_motion(path, MotionFile(ORIGIN, made_up(4, 11), {"person": "somebody"}))
    return path


def test_what_was_written_is_read(tmp_path: Path) -> None:
    path, data = written(tmp_path), made_up(4, 11)
    found = read_motion_file(path)
    assert found.origin == read_origin(path) == ORIGIN
    assert found.notes == {"person": "somebody"}
    for name, array in data.arrays().items():
        np.testing.assert_array_equal(found.data.arrays()[name], array)
        assert found.data.arrays()[name].dtype == array.dtype
    some = read_motion_file(path, slice(1, 3)).data
    np.testing.assert_array_equal(some.joint_position, data.joint_position[1:3])


def test_a_file_says_what_is_in_it(tmp_path: Path) -> None:
    with h5py.File(written(tmp_path), "r") as file:
        assert file.attrs["schema"] == SCHEMA
        assert file["joint_position"].attrs["unit"] == "m"
        assert file["joint_position"].attrs["frame"] == "world"
        assert list(file["joint_position"].attrs["names"])[2] == "left_hand"
        assert list(file["sleeve"].attrs["columns"])[3] == "direction_x"
        assert len(file["intent"].attrs["values"]) == 2
        np.testing.assert_allclose(np.diff(file["time"][:]), 0.05)


def test_equal_content_gives_equal_files(tmp_path: Path) -> None:
    one, two = written(tmp_path, "one.h5"), written(tmp_path, "two.h5")
    assert one.read_bytes() == two.read_bytes()


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path) -> None:
    path = written(tmp_path)
    before = path.read_bytes()
    with pytest.raises(TypeError):
        write_motion(path, MotionFile(ORIGIN, made_up(4, 11), {"bad": object()}))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_sequences_become_arrays_in_order() -> None:
    rng = np.random.default_rng(0)
    flags = np.ones((5, 2), dtype=np.int64)
    some = [
        Sequence(rng.normal(size=(5, 6, 3)), np.full((5, 2, 6), np.nan), k * flags, flags)
        for k in (0, 1)
    ]
    arrays = MotionArrays.of(some)
    assert len(arrays) == 2
    assert arrays.joint_position.dtype == np.float32
    assert arrays.intent[:, 0, 0].tolist() == [0, 1]
    joined = MotionArrays.joined([arrays, arrays])
    np.testing.assert_array_equal(joined.joint_position[2:], arrays.joint_position)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_a_file_that_is_cut_short_is_named(share: float, tmp_path: Path) -> None:
    path = written(tmp_path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(UserError, match=r"a\.h5"):
        read_motion_file(path)


def test_a_byte_that_changed_is_noticed(tmp_path: Path) -> None:
    path = written(tmp_path)
    with h5py.File(path, "r") as file:
        chunk = file["joint_position"].id.get_chunk_info(2)
    whole = bytearray(path.read_bytes())
    whole[chunk.byte_offset + chunk.size // 2] ^= 1
    path.write_bytes(whole)
    assert read_origin(path) == ORIGIN
    with pytest.raises(UserError, match="is damaged"):
        read_motion_file(path)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("schema", "schema: is 'other/1', expected 'drake_dress.motion/1'"),
        ("seed", "is damaged"),
        ("joint_position", "is damaged"),
        ("sleeve", "sleeve: has shape"),
        ("time", "time: has shape"),
    ],
)
def test_a_file_of_another_kind_is_refused(change: str, told: str, tmp_path: Path) -> None:
    path = written(tmp_path)
    with h5py.File(path, "a") as file:
        if change == "schema":
            file.attrs["schema"] = "other/1"
        elif change in file.attrs:
            del file.attrs[change]
        else:
            del file[change]
            if change != "joint_position":
                file[change] = np.zeros((4, 3))
    with pytest.raises(UserError, match=told):
        read_motion_file(path)


def test_no_file_and_no_hdf5_are_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        read_motion_file(tmp_path / "none.h5")
    with pytest.raises(UserError, match="is not an HDF5 file"):
        text = tmp_path / "text.h5"
        text.write_text("x" * 1000)
        read_motion_file(text)
