"""Determines whether an HDF5 file is complete, from its superblock, length and locks.

The wording of HDF5's own messages changes between versions; the superblock does not. It is at byte
0, or at 512, 1024, 2048, … after a user block. It contains the expected length of the file and,
from version 2 on, flags of a writer that has not closed it (HDF5 File Format Specification, section
II.A). A running writer holds a lock.
"""

from __future__ import annotations

import enum
import errno
import fcntl
import os
import stat
from dataclasses import dataclass
from pathlib import Path

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
# Offset of the end-of-file address, by version: this many bytes plus two addresses.
_ADDRESSES_AT = {0: 24, 1: 28, 2: 12, 3: 12}
_FLAGS_AT = 11  # from version 2 on
_OPEN_FOR_WRITING = 0b101  # open for writing, or for writing while others read
_UNDEFINED = 0xFF  # each byte of an undefined address
_LONGEST = 64  # bytes of a superblock that are read


class Hdf5State(enum.Enum):
    """State of a file.

    A `KILLED` file may be readable up to the last flush. Files with superblock versions 0 and 1
    have no flags: for these, `SOUND` only means that the length is as expected.
    """

    SOUND = "is whole"
    TRUNCATED = "is cut short"
    OPEN = "is still being written"
    KILLED = "was left by a program that was killed"
    EMPTY = "is empty"
    NOT_HDF5 = "is not an HDF5 file"


@dataclass(frozen=True)
class Hdf5File:
    """State and size of a file.

    Attributes:
        state: State of the file.
        size: Size, bytes.
        expected: Expected size from the superblock, bytes; None if unknown.
    """

    state: Hdf5State
    size: int
    expected: int | None = None

    @property
    def message(self) -> str:
        """Message for the user, with the sizes if the file is truncated."""
        if self.state is Hdf5State.TRUNCATED and self.expected:
            return f"{self.state.value}: {_sizes(self.size, self.expected)}"
        return self.state.value


def look_at(path: str | Path) -> Hdf5File:
    """Returns the state and size of a file.

    Raises:
        OSError: The file cannot be opened.
    """
    # A pipe without a writer would block.
    number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        mode = os.fstat(number)
        if not stat.S_ISREG(mode.st_mode):
            return Hdf5File(Hdf5State.NOT_HDF5, 0)
        if _is_written(number):
            return Hdf5File(Hdf5State.OPEN, mode.st_size)
        return _read(number, mode.st_size)
    finally:
        os.close(number)


def state_of(path: str | Path) -> Hdf5State:
    """Returns the state of a file.

    Raises:
        OSError: The file cannot be opened.
    """
    return look_at(path).state


def _is_written(number: int) -> bool:
    """Returns whether another process holds the lock that HDF5 takes for writing."""
    try:
        fcntl.flock(number, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError as error:
        # Other errors: the file system has no locks.
        return error.errno in (errno.EWOULDBLOCK, errno.EACCES)
    fcntl.flock(number, fcntl.LOCK_UN)
    return False


def _read(number: int, size: int) -> Hdf5File:
    if size == 0:
        return Hdf5File(Hdf5State.EMPTY, 0)
    start = 0
    while start + len(_SIGNATURE) <= size:
        block = os.pread(number, _LONGEST, start)
        if block.startswith(_SIGNATURE):
            return _judged(block, size)
        start = max(512, 2 * start)
    beginning = os.pread(number, len(_SIGNATURE), 0)
    if size < len(_SIGNATURE) and _SIGNATURE.startswith(beginning):
        return Hdf5File(Hdf5State.TRUNCATED, size)
    return Hdf5File(Hdf5State.NOT_HDF5, size)


def _judged(block: bytes, size: int) -> Hdf5File:
    """Returns the state of a file from its superblock and its size."""
    version = block[8] if len(block) > 8 else None
    if version is None:
        return Hdf5File(Hdf5State.TRUNCATED, size)
    if version not in _ADDRESSES_AT:
        return Hdf5File(Hdf5State.NOT_HDF5, size)
    place = 9 if version >= 2 else 13
    width = block[place] if len(block) > place else 0
    begin = _ADDRESSES_AT[version] + 2 * width
    end = block[begin : begin + width]
    if not width or len(end) < width:
        return Hdf5File(Hdf5State.TRUNCATED, size)
    killed = version >= 2 and bool(block[_FLAGS_AT] & _OPEN_FOR_WRITING)
    if end == bytes([_UNDEFINED]) * width:
        return Hdf5File(Hdf5State.KILLED, size)
    # The library compares the file's length with the stored address, which includes the user block.
    expected = int.from_bytes(end, "little")
    if size < expected:
        return Hdf5File(Hdf5State.TRUNCATED, size, expected)
    return Hdf5File(Hdf5State.KILLED if killed else Hdf5State.SOUND, size, expected)


def _sizes(size: int, expected: int) -> str:
    if expected < 10_000:
        return f"{size} of {expected} bytes"
    unit, name = (1e3, "kB") if expected < 10_000_000 else (1e6, "MB")
    # Round down, so that a file that lacks its last bytes does not look complete.
    return f"{int(size / unit)} of {-int(-expected // unit)} {name}"
