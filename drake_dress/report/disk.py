"""Room on a disk that is kept before it is needed, and a file that is kept from others.

HDF5 does not survive a write that fails: later uses of the file, and the end of the process, may
crash. What is asked beforehand, whether there is room, may be wrong a moment later. So blocks are
allocated to the file first, where a write cannot fail for want of them.
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
    """Has bytes of an open file allocated; they stay until it is made shorter or `give_back`.

    Where the file system cannot, so much must be free.

    Args:
        number: of the file, whose length stays as it is.
        start: of them.
        size: how many.

    Raises:
        OSError: there is no room.
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
    """Frees what is allocated beyond the end of an open file."""
    os.ftruncate(number, os.fstat(number).st_size)


def reserved(directory: Path, size: int) -> int | None:
    """Returns an open file without a name that takes so many bytes; None if there is no room."""
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
    """Returns a file that is locked as HDF5 locks what it writes, and stays so until it is closed.

    HDF5's own lock would end wherever it is opened anew, and who read then would keep us out.

    Raises:
        OSError: it cannot be, or another one writes or reads it.
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
    """Returns 0 or an error's number."""
    try:
        fallocate = _LIBC.fallocate
    except AttributeError:
        return errno.ENOSYS
    begin, count = ctypes.c_longlong(start), ctypes.c_longlong(size)
    return ctypes.get_errno() if fallocate(number, _KEEP_SIZE, begin, count) else 0
