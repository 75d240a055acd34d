"""Cases that run side by side: all are done, and a signal ends the study at once."""

from __future__ import annotations

import os
import signal
import threading
import time

import pytest

from drake_dress.interrupt import Interrupt, caught_interrupt, signals_raised
from drake_dress.side_by_side import completed


@pytest.mark.parametrize("jobs", [1, 3])
def test_each_case_is_done_once(jobs: int) -> None:
    done = list(completed(lambda c: c * c, range(20), jobs, Interrupt()))
    assert sorted(done) == [(c, c * c) for c in range(20)]


def test_no_case_begins_after_the_signal() -> None:
    begun: list[int] = []
    stop = Interrupt()

    def run(case: int) -> int:
        begun.append(case)
        if len(begun) == 3:
            stop.set()
        time.sleep(0.01)
        return case

    done = [case for case, _ in completed(run, range(100), 1, stop)]
    assert done == begun[: len(done)]
    assert begun == [0, 1, 2]


def test_a_second_signal_raises_and_leaves_what_was_not_begun() -> None:
    begun: list[int] = []
    go_on = threading.Event()

    def run(case: int) -> int:
        begun.append(case)
        if case == 0:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.1)
            os.kill(os.getpid(), signal.SIGTERM)
        go_on.wait(0.5)
        return case

    with signals_raised(), pytest.raises(KeyboardInterrupt), caught_interrupt() as stop:
        for _ in completed(run, range(100), 1, stop):
            pass
    assert stop.is_set()
    assert len(begun) <= 3
