"""The state of a file follows from its bytes, length and locks, for each format of HDF5."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.hdf5_state import Hdf5State, look_at, state_of

FORMATS = ("earliest", "v108", "v110", "latest")


def write(path: Path, libver: str = "earliest", userblock: int = 0) -> bytes:
    with h5py.File(path, "w", libver=libver, userblock_size=userblock) as file:
        file["a"] = np.arange(500.0)
        file.create_dataset("b", data=np.ones((4, 50)), chunks=(1, 50), compression="gzip")
    return path.read_bytes()


@pytest.mark.parametrize("userblock", [0, 512, 2048])
@pytest.mark.parametrize("libver", FORMATS)
def test_a_file_is_whole_until_a_byte_is_missing(
    tmp_path: Path, libver: str, userblock: int
) -> None:
    path = tmp_path / "a.h5"
    data = write(path, libver, userblock)
    found = look_at(path)
    assert found.state is Hdf5State.SOUND
    assert found.expected == found.size == len(data)
    for length in (len(data) - 1, len(data) // 2, userblock + 100):
        path.write_bytes(data[:length])
        found = look_at(path)
        assert found.state is Hdf5State.TRUNCATED
        assert (found.size, found.expected) == (length, len(data))
        assert found.message.startswith("is cut short: ")
    for length in (userblock + 8, userblock + 20):
        path.write_bytes(data[:length])
        assert state_of(path) is Hdf5State.TRUNCATED


@settings(max_examples=60)
@given(data=st.data())
def test_wherever_a_file_is_cut_it_is_never_sound(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("cut") / "a.h5"
    whole = write(path, data.draw(st.sampled_from(FORMATS)))
    path.write_bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
    expected = Hdf5State.TRUNCATED if path.stat().st_size else Hdf5State.EMPTY
    assert state_of(path) is expected


@pytest.mark.parametrize("libver", FORMATS)
def test_a_file_that_is_written_is_open_and_one_that_is_read_is_not(
    tmp_path: Path, libver: str
) -> None:
    path = tmp_path / "a.h5"
    write(path, libver)
    with h5py.File(path, "a"):
        assert state_of(path) is Hdf5State.OPEN
    with h5py.File(path, "r"):
        assert state_of(path) is Hdf5State.SOUND
    assert state_of(path) is Hdf5State.SOUND


@pytest.mark.parametrize("libver", FORMATS)
def test_a_file_whose_writer_was_killed_says_so_where_its_format_can(
    tmp_path: Path, libver: str
) -> None:
    path = tmp_path / "a.h5"
    script = (
        "import h5py, os\n"
        f"file = h5py.File({str(path)!r}, 'w', libver={libver!r})\n"
        "file['a'] = list(range(500))\n"
        "file.flush()\n"
        "os._exit(9)\n"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 9
    expected = Hdf5State.SOUND if libver == "earliest" else Hdf5State.KILLED
    assert state_of(path) is expected


def test_sizes_never_look_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["a"] = np.zeros(250_000)
    os.truncate(path, path.stat().st_size - 1)
    had, expected = look_at(path).message.removeprefix("is cut short: ").split(" of ")
    assert int(had) < int(expected.removesuffix(" kB"))


def test_other_files_are_told(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    for data, state in (
        (b"", Hdf5State.EMPTY),
        (b"time,x\n0,1\n" * 500, Hdf5State.NOT_HDF5),
        (b"\x89HDF\r\n", Hdf5State.TRUNCATED),
        (b"\x89HDF\r\n\x1a\n" + bytes([77]) * 100, Hdf5State.NOT_HDF5),
    ):
        path.write_bytes(data)
        assert state_of(path) is state
    os.mkfifo(tmp_path / "pipe")
    assert state_of(tmp_path / "pipe") is Hdf5State.NOT_HDF5
    assert state_of(tmp_path) is Hdf5State.NOT_HDF5
    with pytest.raises(FileNotFoundError):
        state_of(tmp_path / "nothing")
