"""Processes that run simulations of an experiment.

They are spawned: one that is forked from a process with threads, Numba and BLAS may hang. Each gets
what it works with once, as it begins, so that experiments that are open at once have processes and
data of their own. Processes end with the pool, whatever they do then, and with the process that
opened it, however that ends. They leave Ctrl-C to it.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import Connection
from typing import Any

from drake_dress.errors import FailedError

_common: Any = None


class Workers:
    """Calls functions in processes; a context manager, whose end ends them.

    Args:
        common: what every function is given first; it is pickled once.
        count: of processes.
    """

    def __init__(self, common: Any, count: int) -> None:
        context = multiprocessing.get_context("spawn")
        # whoever holds the other end of this pipe ends once nobody holds this one
        ended, self._alive = context.Pipe(duplex=False)
        self._ended = ended
        self._pool = ProcessPoolExecutor(
            count,
            mp_context=context,
            initializer=_begin,
            initargs=(pickle.dumps(common, pickle.HIGHEST_PROTOCOL), ended),
        )

    def map(
        self,
        function: Callable[..., Any],
        work: Iterable[Sequence[Any]],
        progress: Callable[[], None] | None = None,
    ) -> list[Any]:
        """Returns `function(common, *arguments)` for all arguments in `work`, in order.

        Args:
            function: can be pickled.
            work: arguments of each call.
            progress: called after each.

        Raises:
            FailedError: a process has ended.
        """
        results = []
        try:
            futures: list[Future[Any]] = [self._pool.submit(_call, function, *w) for w in work]
            for future in futures:
                results.append(future.result())
                if progress is not None:
                    progress()
        except BrokenProcessPool:
            raise FailedError(
                "a process that simulates has ended before its work was done, as where memory "
                "runs out; with fewer processes less is needed"
            ) from None
        return results

    def end(self) -> None:
        """Ends the processes, and what they do."""
        self._alive.close()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._ended.close()


def _begin(common: bytes, ended: Connection) -> None:
    global _common
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(ended,), daemon=True).start()
    _common = pickle.loads(common)


def _end_with(ended: Connection) -> None:
    ended.poll(None)
    os._exit(1)


def _call(function: Callable[..., Any], *arguments: Any) -> Any:
    return function(_common, *arguments)
