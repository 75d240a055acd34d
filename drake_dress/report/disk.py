"""Reserves disk space in advance and locks a file against other processes.

HDF5 does not survive a failed write: later uses of the file, and the end of the process, may crash.
Checking the free space beforehand is not enough, since it may be gone a moment later. Therefore,
blocks are allocated to the file first, so that a write cannot run out of space.
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import os
import tempfile
from pathlib import Path

_KEEP_SIZE = 1  # FALLOC_FL_KEEP_SIZE: blocks beyond the end do not make the file longer
_LIBC = ctypes.CDLL(None, use_errno=True)
_UNKNOWN = (errno.ENOSYS, errno.EOPNOTSUPP)


def keep_room(number: int, start: int, size: int) -> None:
    """Allocates bytes of an open file; they stay until it is truncated or `give_back` is called.

    If the file system cannot allocate, only checks that enough space is free.

    Args:
        number: File descriptor; the length of the file does not change.
        start: Offset of the first byte.
        size: Number of bytes.

    Raises:
        OSError: There is not enough space.
    """
    code = _allocate(number, start, size)
    while code == errno.EINTR:
        code = _allocate(number, start, size)
    if code in _UNKNOWN:
        disk = os.fstatvfs(number)
        code = 0 if disk.f_bavail * disk.f_frsize >= size else errno.ENOSPC
    if code:
        raise OSError(code, os.strerror(code))


def give_back(number: int) -> None:
    """Frees the blocks allocated beyond the end of an open file."""
    os.ftruncate(number, os.fstat(number).st_size)


def reserved(directory: Path, size: int) -> int | None:
    """Returns an open, unnamed file of `size` bytes; None if there is not enough space."""
    try:
        number, name = tempfile.mkstemp(dir=directory)
        os.unlink(name)
        try:
            os.posix_fallocate(number, 0, size)
        except OSError:
            os.close(number)
            raise
        return number
    except OSError:
        return None


def locked(path: Path) -> int:
    """Opens a file and locks it, as HDF5 does for writing, until it is closed.

    HDF5 releases its own lock whenever the log is closed and opened again; a process that reads the
    file at that moment would lock the writer out.

    Raises:
        OSError: The file cannot be opened, or another process reads or writes it.
    """
    number = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        # not every file system has locks
        if error.errno not in (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP):
            os.close(number)
            raise
    return number


def _allocate(number: int, start: int, size: int) -> int:
    """Returns 0 or an error number."""
    try:
        fallocate = _LIBC.fallocate
    except AttributeError:
        return errno.ENOSYS
    begin, count = ctypes.c_longlong(start), ctypes.c_longlong(size)
    return ctypes.get_errno() if fallocate(number, _KEEP_SIZE, begin, count) else 0
