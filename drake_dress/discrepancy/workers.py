"""Processes that run simulations of an experiment.

Each gets what it works with once, as it begins, so that experiments that are open at once have
processes and data of their own. What is sent may hold classes that the other process cannot import,
such as an effect from a notebook's cell: cloudpickle sends those themselves.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from typing import Any

import cloudpickle

from drake_dress.errors import FailedError
from drake_dress.worker_pool import WorkerPool

_common: Any = None


class Workers:
    """Calls functions in processes.

    Args:
        common: what every function is given first; it is pickled once.
        count: of processes.
    """

    def __init__(self, common: Any, count: int) -> None:
        data = cloudpickle.dumps(common)
        self._pool = WorkerPool(count, initializer=_begin, initargs=(data,))

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
        return answers([submit(self._pool, _call, function, *w) for w in work], progress)

    def end(self) -> None:
        """Ends the processes, and what they do."""
        self._pool.kill()
        self._pool.shutdown(cancel_futures=True)


def answers(
    futures: Iterable[Future[Any]], progress: Callable[[], None] | None = None
) -> list[Any]:
    """Returns the results of futures, in order; `progress` is called after each.

    Raises:
        FailedError: a process has ended.
    """
    results = []
    try:
        for future in futures:
            results.append(future.result())
            if progress is not None:
                progress()
    except BrokenProcessPool:
        raise FailedError(
            "a process that simulates has ended before its work was done, as where memory runs out "
            "(fewer processes need less), or where a script starts processes outside "
            'if __name__ == "__main__":'
        ) from None
    return results


def submit(pool: Executor, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
    """Returns what will be the result of a function in another process.

    Args:
        pool: of processes.
        function: that is called.
        arguments: of it; their classes need not be known to the other process.
    """
    return pool.submit(_unpacked, cloudpickle.dumps((function, arguments)))


def _unpacked(data: bytes) -> Any:
    function, arguments = pickle.loads(data)
    return function(*arguments)


def _begin(common: bytes) -> None:
    global _common
    _common = pickle.loads(common)


def _call(function: Callable[..., Any], *arguments: Any) -> Any:
    return function(_common, *arguments)
