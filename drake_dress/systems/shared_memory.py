"""Memory shared by processes, without /dev/shm, which containers may lack."""

from __future__ import annotations

import mmap
import os
import tempfile
import weakref
from collections.abc import Callable
from multiprocessing import reduction
from typing import Any


class SharedMemory:
    """Memory that a process shares with child processes to which it is passed.

    It can be pickled only while a child process is being started.

    Args:
        size: Number of bytes, more than 0.

    Attributes:
        memory: The bytes, initially 0.
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
    """Returns an open file in memory, or an unnamed temporary file if memfd is not available."""
    try:
        return os.memfd_create("drake-dress")
    except (AttributeError, OSError):
        with tempfile.TemporaryFile() as file:
            return os.dup(file.fileno())


def _opened(number: Any, size: int) -> SharedMemory:
    shared = SharedMemory.__new__(SharedMemory)
    shared._take(number.detach(), size)
    return shared
