"""Memory that two processes share, without /dev/shm, which containers may lack."""

from __future__ import annotations

import mmap
import os
import tempfile
import weakref
from collections.abc import Callable
from multiprocessing import reduction
from typing import Any


class SharedMemory:
    """Memory that a process has in common with those that it starts and passes this to.

    It can be pickled only for a process that is being started.

    Args:
        size: bytes, more than 0.

    Attributes:
        memory: the bytes, 0 at first.
    """

    def __init__(self, size: int) -> None:
        number = _file()
        os.ftruncate(number, size)
        self._take(number, size)

    def _take(self, number: int, size: int) -> None:
        self._number, self._size = number, size
        self.memory = mmap.mmap(number, size)
        weakref.finalize(self, os.close, number)

    def __reduce__(self) -> tuple[Callable[..., SharedMemory], tuple[Any, ...]]:
        return _opened, (reduction.DupFd(self._number), self._size)


def _file() -> int:
    """Returns an open file that is in memory alone, or without a name where that is not known."""
    try:
        return os.memfd_create("drake-dress")
    except (AttributeError, OSError):
        with tempfile.TemporaryFile() as file:
            return os.dup(file.fileno())


def _opened(number: Any, size: int) -> SharedMemory:
    shared = SharedMemory.__new__(SharedMemory)
    shared._take(number.detach(), size)
    return shared
