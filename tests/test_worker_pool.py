"""Worker processes need no /dev/shm and end with the process that started them."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import pytest

from drake_dress.systems.shared_memory import SharedMemory
from drake_dress.worker_pool import WorkerPool

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def no_semaphores(monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes each semaphore fail, as on a read-only /dev/shm."""

    def refused(*_: object, **__: object) -> None:
        raise OSError(30, "Read-only file system", "/dev/shm/sem")

    monkeypatch.setattr("_multiprocessing.SemLock", refused)
    monkeypatch.setattr("multiprocessing.heap.Arena.__init__", refused)


def fail(message: str) -> None:
    raise KeyError(message)


def unpicklable() -> object:
    return lambda: None


def test_results_and_errors_come_back_in_order() -> None:
    with WorkerPool(2) as pool:
        futures = [pool.submit(pow, k, 2) for k in range(9)]
        wrong, strange = pool.submit(fail, "no"), pool.submit(unpicklable)
        assert [f.result() for f in futures] == [k * k for k in range(9)]
        with pytest.raises(KeyError, match="no"):
            wrong.result()
        with pytest.raises(RuntimeError, match="pickle"):
            strange.result()
        processes = {f.result() for f in [pool.submit(os.getpid) for _ in range(8)]}
        assert os.getpid() not in processes
        assert len(processes) <= 2
    for process in processes:
        assert not Path(f"/proc/{process}").exists()


def test_any_way_to_begin_a_process_will_do() -> None:
    with WorkerPool(1, multiprocessing.get_context("fork"), np.seterr, ()) as pool:
        assert pool.submit(sum, [1, 2]).result() == 3


def test_signals_are_left_to_the_parent_and_its_end_is_theirs() -> None:
    with WorkerPool(1) as pool:
        process = pool.submit(os.getpid).result()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            os.kill(process, number)
        assert pool.submit(os.getpid).result() == process
        waiting = pool.submit(time.sleep, 60.0)
        time.sleep(0.1)
        pool.kill()
        with pytest.raises(BrokenProcessPool):
            waiting.result()


def test_an_exception_does_not_wait_for_work() -> None:
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt), WorkerPool(1) as pool:
        pool.submit(time.sleep, 60.0)
        raise KeyboardInterrupt
    assert time.monotonic() - begin < 30.0


def test_a_program_that_forgets_its_processes_ends_all_the_same() -> None:
    code = (
        "from drake_dress.worker_pool import WorkerPool\n"
        "import multiprocessing, time\n"
        "from multiprocessing import get_context\n"
        "from drake_dress.worker_pool import end_with, kill_at_exit\n"
        "from tests.test_worker_pool import forever\n"
        "import os\n"
        "if __name__ == '__main__':\n"
        "    pool = WorkerPool(1)\n"
        "    pool.submit(abs, 1).result()\n"
        "    spawn = get_context('spawn')\n"
        "    process = spawn.Process(target=forever, args=(os.getpid(),), daemon=True)\n"
        "    process.start()\n"
        "    kill_at_exit(process)\n"
        "    time.sleep(1.0)\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, timeout=60)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_to_the_whole_group_reaches_no_process_that_begins(
    number: signal.Signals, tmp_path: Path
) -> None:
    """This holds although Python unblocks these signals when it spawns the first process."""
    code = (
        "import os, signal, sys\n"
        "from multiprocessing import get_context\n"
        "from drake_dress.worker_pool import start_process\n"
        "def blocked(pipe):\n"
        "    pipe.send(signal.pthread_sigmask(signal.SIG_BLOCK, ()))\n"
        "if __name__ == '__main__':\n"
        "    here, there = get_context('spawn').Pipe()\n"
        "    process = get_context('spawn').Process(target=blocked, args=(there,))\n"
        "    start_process(process)\n"
        f"    sys.exit({int(number)} not in here.recv())\n"
    )
    program = tmp_path / "program.py"
    program.write_text(code)
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, program], env=environment, check=True, timeout=60)


@pytest.mark.parametrize("large", [10, 10_000_000])
def test_a_process_that_ends_at_its_beginning_is_told(large: int) -> None:
    """This holds however much data it should have received, which is never read."""
    with WorkerPool(1, initializer=end_after, initargs=(bytes(large),)) as pool:
        with pytest.raises(BrokenProcessPool, match="exit 3"):
            pool.submit(abs, 1).result(60.0)


def end_after(_: bytes) -> None:
    os._exit(3)


def forever(parent: int) -> None:
    from drake_dress.worker_pool import end_with

    end_with(parent)
    time.sleep(600.0)


def fill(shared: SharedMemory) -> None:
    np.frombuffer(shared.memory, np.float64)[:] = np.arange(5.0)


@pytest.mark.parametrize("known", [True, False])
def test_memory_is_shared_with_a_process_that_is_started(
    known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not known:
        monkeypatch.delattr(os, "memfd_create")
    shared = SharedMemory(40)
    assert not any(shared.memory[:])
    process = multiprocessing.get_context("spawn").Process(target=fill, args=(shared,))
    process.start()
    process.join()
    assert process.exitcode == 0
    np.testing.assert_array_equal(np.frombuffer(shared.memory, np.float64), np.arange(5.0))
