"""Worker processes that run the simulations of an experiment.

Each process receives the common data once, when it starts, so that experiments that are open at the
same time have their own processes and data. Data are pickled with cloudpickle: they may use classes
that the worker process cannot import, such as an effect defined in a notebook's cell.
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
    """Calls functions in worker processes.

    Args:
        common: first argument of every function; it is pickled once.
        count: number of processes.
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
            function: a function that can be pickled.
            work: arguments of each call.
            progress: called after each result.

        Raises:
            FailedError: a process has ended.
        """
        return answers([submit(self._pool, _call, function, *w) for w in work], progress)

    def end(self) -> None:
        """Kills the processes and cancels pending calls."""
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
    """Calls a function in a worker process and returns the future of its result.

    Args:
        pool: pool of processes.
        function: function to call.
        arguments: its arguments; the worker process need not be able to import their classes.
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
