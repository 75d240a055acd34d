"""Function calls on a thread, or in a worker process, which does not slow down the calling one."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any

from drake_dress.worker_pool import WorkerPool

_NICENESS = 10
_worker: Callable[..., Any] | None = None


def on_a_thread(work: Callable[..., Any], name: str) -> Callable[..., Future[Any]]:
    """Returns a function that calls `work` on a thread of this process, one call at a time."""
    return partial(ThreadPoolExecutor(1, name).submit, work)


class WorkerProcess:
    """Calls `work` in a worker process, one call at a time.

    The worker starts at once and ignores Ctrl-C. It ends with this process, even on a crash.

    Args:
        work: Function to call; it, its arguments and its result must be picklable.
    """

    def __init__(self, work: Callable[..., Any]) -> None:
        self._work = work
        self._start()

    def _start(self) -> None:
        self._pool = WorkerPool(1, initializer=_begin, initargs=(self._work,))

    def submit(self, *arguments: Any) -> Future[Any]:
        """Returns a future of the result; starts a new process if the old one has ended."""
        if not self._pool.alive:
            self._start()
        return self._pool.submit(_work, *arguments)

    def kill(self) -> None:
        """Ends the process immediately; pending results become exceptions."""
        self._pool.kill()


def _begin(work: Callable[..., Any]) -> None:
    global _worker
    _worker = work
    gc.freeze()
    # with few cores, the process that sends commands has priority
    os.nice(_NICENESS)


def _work(*arguments: Any) -> Any:
    if _worker is None:
        raise RuntimeError("the process has not begun")
    return _worker(*arguments)
