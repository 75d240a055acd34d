"""Runs cases side by side in threads, until a signal ends the study."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import TypeVar

from drake_dress.interrupt import Interrupt

C = TypeVar("C")
R = TypeVar("R")


def completed(
    run: Callable[[C], R], cases: Sequence[C], jobs: int, stop: Interrupt
) -> Iterator[tuple[C, R]]:
    """Yields each case with what it came to, as soon as it is done.

    After the first signal that ends a command no case begins, and what is done next is the last
    that is yielded. A second one raises; cases that were not begun are not waited for then, either.
    """
    with ThreadPoolExecutor(jobs) as pool:
        pending = {pool.submit(run, case): case for case in cases}
        try:
            for future in as_completed(pending):
                yield pending[future], future.result()
                if stop.is_set():
                    break
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
