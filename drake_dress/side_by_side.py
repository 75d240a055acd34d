"""Runs cases in parallel threads until a signal ends the study."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import TypeVar

from drake_dress.interrupt import Interrupt

C = TypeVar("C")
R = TypeVar("R")


class _NotStarted(Exception):
    """A case came up after the signal."""


def completed(
    run: Callable[[C], R], cases: Sequence[C], jobs: int, stop: Interrupt
) -> Iterator[tuple[C, R]]:
    """Yields each case with its result as soon as it is done.

    After the first ending signal no further case starts, and the next finished case is the last one
    yielded. A second signal raises; cases that have not started are cancelled then, too.
    """

    def started(case: C) -> R:
        # a thread takes the next case before the loop below hears of the last one
        if stop.is_set():
            raise _NotStarted
        return run(case)

    with ThreadPoolExecutor(jobs) as pool:
        pending = {pool.submit(started, case): case for case in cases}
        try:
            for future in as_completed(pending):
                try:
                    result = future.result()
                except _NotStarted:
                    continue
                yield pending[future], result
                if stop.is_set():
                    break
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
