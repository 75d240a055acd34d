"""Processes that work side by side and need neither semaphores nor /dev/shm.

Python's own pool makes semaphores, for which /dev/shm must be there and writable; in many
containers it is not. Here each process has a pipe and a thread that talks to it, which works
anywhere. Used like `concurrent.futures.ProcessPoolExecutor`.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import multiprocessing
import os
import signal
import weakref
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from queue import SimpleQueue
from typing import Any

from drake_dress.interrupt import signals_deferred

_PR_SET_PDEATHSIG = 1
_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class WorkerPool(Executor):
    """Calls functions in other processes; a context manager that ends them.

    Processes begin at once, end with this one however that ends, and leave Ctrl-C and other signals
    to it. When the context ends with an exception they are killed, whatever they do.

    Args:
        max_workers: how many.
        mp_context: how processes begin; by default they are spawned, since Numba and BLAS may hang
            in what is forked from a process with threads.
        initializer: called in each process first; it can be pickled.
        initargs: its arguments.
    """

    def __init__(
        self,
        max_workers: int,
        mp_context: BaseContext | None = None,
        initializer: Callable[..., object] | None = None,
        initargs: Sequence[Any] = (),
    ) -> None:
        context: Any = mp_context or multiprocessing.get_context("spawn")
        self._threads = ThreadPoolExecutor(max_workers, "worker-pool")
        self._free: SimpleQueue[tuple[Connection, BaseProcess]] = SimpleQueue()
        self._processes: list[BaseProcess] = []
        self._killed = False
        # Python waits at its end for processes, which ignore the signal that it sends them.
        atexit.register(_kill_all, weakref.WeakMethod(self.kill))
        pipes = []
        for _ in range(max_workers):
            pipe, other = context.Pipe()
            process = context.Process(target=_serve, args=(other, os.getpid()))
            start_process(process)
            other.close()
            self._processes.append(process)
            pipes.append(pipe)
        for pipe, process in zip(pipes, self._processes, strict=True):
            # Of one that has ended already, the first call tells.
            with contextlib.suppress(OSError):
                pipe.send((initializer, tuple(initargs)))
            self._free.put((pipe, process))

    @property
    def alive(self) -> bool:
        """Whether no process has ended."""
        return not self._killed and all(process.is_alive() for process in self._processes)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Returns what will be the result of `fn`, which can be pickled, as can all else."""
        return self._threads.submit(self._call, fn, args, kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Ends the processes when their work is done."""
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        if wait:
            while not self._free.empty():
                pipe, _ = self._free.get()
                # In what was forked, the pipe has further ends and does not close.
                with contextlib.suppress(OSError):
                    pipe.send(None)
                pipe.close()
            for process in self._processes:
                process.join()

    def kill(self) -> None:
        """Ends the processes whatever they do; results that are awaited become exceptions."""
        self._killed = True
        for process in self._processes:
            with contextlib.suppress(ValueError):
                process.kill()

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if error is not None:
            self.kill()
        self.shutdown(cancel_futures=error is not None)

    def _call(self, fn: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        """Has the next free process call a function; runs in a thread."""
        pipe, process = self._free.get()
        try:
            pipe.send((fn, args, kwargs))
            good, result = pipe.recv()
        except (EOFError, OSError) as error:
            process.join(1.0)
            raise BrokenProcessPool(f"a process has ended (exit {process.exitcode})") from error
        finally:
            self._free.put((pipe, process))
        if good:
            return result
        raise result


def start_process(process: BaseProcess) -> None:
    """Starts a process to which no signal comes before it leaves signals to this one.

    Ctrl-C and `timeout` send them to all processes of a group. What the process is given should be
    small: this one waits for ever where it has more to write than a pipe holds and the reader ends.
    """
    # Its own start lets SIGINT and SIGTERM through again, so it has to come first.
    resource_tracker.ensure_running()
    with signals_deferred():
        process.start()


def end_with(parent: int) -> None:
    """Has this process end with its parent, however that ends, and leave signals to it."""
    for number in _ENDING:
        signal.signal(number, signal.SIG_IGN)
    with contextlib.suppress(AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        # it ended before the kernel was told
        os._exit(1)


def kill_at_exit(process: BaseProcess) -> None:
    """Has a process end with this one, before Python waits for it."""
    atexit.register(_kill_all, weakref.WeakMethod(process.kill))


def _kill_all(kill: weakref.WeakMethod[Callable[[], None]]) -> None:
    method = kill()
    if method is not None:
        with contextlib.suppress(ValueError, AttributeError):
            method()


def _serve(pipe: Connection, parent: int) -> None:
    end_with(parent)
    try:
        initializer, initargs = pipe.recv()
    except (EOFError, OSError):
        return
    if initializer is not None:
        initializer(*initargs)
    while True:
        try:
            work = pipe.recv()
        except (EOFError, OSError):
            return
        if work is None:
            return
        fn, args, kwargs = work
        try:
            answer = True, fn(*args, **kwargs)
        except Exception as error:
            answer = False, error
        try:
            pipe.send(answer)
        except OSError:
            return
        except Exception as error:
            # What came out of it cannot be pickled.
            pipe.send((False, RuntimeError(f"{type(error).__name__}: {error}")))
