"""Calls in a worker process, which take no time from the process that waits for them."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from drake_dress.worker_pool import WorkerPool

_NICENESS = 10
_worker: Callable[..., Any] | None = None


class WorkerProcess:
    """Calls `work` in a worker process, one call at a time.

    The worker starts at once, ends with this process however that ends, and ignores Ctrl-C.

    Args:
        work: can be pickled, as can what it takes and returns.
    """

    def __init__(self, work: Callable[..., Any]) -> None:
        self._work = work
        self._start()

    def _start(self) -> None:
        self._pool = WorkerPool(1, initializer=_begin, initargs=(self._work,))

    def submit(self, *arguments: Any) -> Future[Any]:
        """Returns what will be the result; where the process has ended, another one begins."""
        if not self._pool.alive:
            self._start()
        return self._pool.submit(_work, *arguments)

    def kill(self) -> None:
        """Ends the process whatever it does; results that are awaited become exceptions."""
        self._pool.kill()


def _begin(work: Callable[..., Any]) -> None:
    global _worker
    _worker = work
    gc.freeze()
    # who sends commands goes first where cores are few
    os.nice(_NICENESS)


def _work(*arguments: Any) -> Any:
    if _worker is None:
        raise RuntimeError("the process has not begun")
    return _worker(*arguments)
