"""Work that is done in a process of its own, so that it takes no time from who waits for it."""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import os
import signal
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any

_PR_SET_PDEATHSIG = 1
_NICENESS = 10
_worker: Callable[..., Any] | None = None


class Apart:
    """Calls `work` in another process, one call at a time.

    The process begins at once, ends with this one however that ends, and leaves Ctrl-C to it.

    Args:
        work: can be pickled, as can what it takes and returns.
    """

    def __init__(self, work: Callable[..., Any]) -> None:
        self._work = work
        self._start()

    def _start(self) -> None:
        self._killed = False
        # forked from a process with threads, Numba and BLAS may hang
        self._pool = ProcessPoolExecutor(
            max_workers=1,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_begin,
            initargs=(self._work, os.getpid()),
        )
        self._process = self._pool.submit(os.getpid)

    def submit(self, *arguments: Any) -> Future[Any]:
        """Returns what will be the result; where the process has ended, another one begins."""
        if not self._killed:
            with contextlib.suppress(BrokenProcessPool):
                return self._pool.submit(_work, *arguments)
        self._start()
        return self._pool.submit(_work, *arguments)

    def kill(self) -> None:
        """Ends the process whatever it does; results that are awaited become exceptions."""
        self._killed = True
        if self._process.done() and self._process.exception() is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self._process.result(), signal.SIGKILL)


def _begin(work: Callable[..., Any], parent: int) -> None:
    global _worker
    _worker = work
    # who sends commands goes first where cores are few
    os.nice(_NICENESS)
    end_with(parent)


def end_with(parent: int) -> None:
    """Has this process end with its parent, however that ends, and leave Ctrl-C to it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        # it ended before the kernel was told
        os._exit(1)


def _work(*arguments: Any) -> Any:
    if _worker is None:
        raise RuntimeError("the process has not begun")
    return _worker(*arguments)
