"""Processes that simulate: each pool has its own, and none outlives it or hides that it is gone."""

import operator
import os
import subprocess
import sys
import time

import numpy as np
import pytest

from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.workers import Workers
from drake_dress.errors import FailedError
from drake_dress.models.effects.mass import SurfaceDensity
from tests.discrepancy.data import SCENARIO, quick_scenario, recordings


def test_pools_that_are_open_at_once_have_data_of_their_own() -> None:
    first, second = Workers(10, 1), Workers(20, 1)
    try:
        for _ in range(2):
            assert first.map(operator.add, [(1,), (2,)]) == [11, 12]
            assert second.map(operator.add, [(1,), (2,)]) == [21, 22]
    finally:
        first.end()
        second.end()


def test_a_process_that_is_gone_is_told_in_one_line() -> None:
    workers = Workers(9, 1)
    try:
        with pytest.raises(FailedError, match="a process that simulates has ended") as caught:
            workers.map(os._exit, [()])
        assert "\n" not in str(caught.value)
        assert caught.value.__cause__ is None
        assert caught.value.__suppress_context__
    finally:
        workers.end()


def test_the_end_does_not_wait_for_what_is_under_way() -> None:
    workers = Workers(600.0, 1)
    pid = workers.map(_pid, [()])[0]
    workers._pool.submit(time.sleep, 600.0)
    begin = time.monotonic()
    workers.end()
    assert time.monotonic() - begin < 30.0
    assert not _running(pid)


def test_processes_end_with_whoever_began_them() -> None:
    """Also where that one is killed in the middle of their work."""
    code = (
        "import os, signal, time\n"
        "from drake_dress.discrepancy.workers import Workers\n"
        "if __name__ == '__main__':\n"
        "    workers = Workers(600.0, 1)\n"
        "    workers._pool.submit(time.sleep, 600.0)\n"
        "    print(workers._pool._processes[0].pid, flush=True)\n"
        "    time.sleep(2.0)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    pids = [int(word) for word in done.stdout.split()[-1:]]
    assert pids
    deadline = time.monotonic() + 30.0
    while _running(pids[0]) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not _running(pids[0])


def test_experiments_that_are_open_at_once_tell_what_each_tells_alone() -> None:
    def opened(effects: list[SurfaceDensity]) -> Experiment:
        made = recordings(("sway",), effects, 0.6)
        return Experiment(quick_scenario(), SCENARIO.parent, made, workers=1)

    def told(experiment: Experiment) -> np.ndarray:
        ((found,),) = experiment.tell([("screening", ())])
        return np.concatenate([found.marker.ravel(), found.force.ravel()])

    hidden: tuple[list[SurfaceDensity], ...] = ([], [SurfaceDensity(added=0.1)])
    with opened(hidden[0]) as one, opened(hidden[1]) as other:
        together = [told(one), told(other)]
    alone = []
    for effects in hidden:
        with opened(effects) as experiment:
            alone.append(told(experiment))
    np.testing.assert_array_equal(together[0], alone[0])
    np.testing.assert_array_equal(together[1], alone[1])
    assert not np.array_equal(together[0], together[1])


def _pid(common: float) -> int:
    return os.getpid()


def _running(pid: int) -> bool:
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as stat:
            return stat.read().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False
