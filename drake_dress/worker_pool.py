"""A pool of worker processes that needs neither semaphores nor /dev/shm.

Python's own pool creates semaphores, which require a writable /dev/shm; many containers lack it.
Here each process has a pipe and a thread that communicates with it, which works anywhere. The
interface is that of `concurrent.futures.ProcessPoolExecutor`.
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
    """Calls functions in worker processes; a context manager that ends them.

    Workers start at once and leave Ctrl-C and other signals to this process. They end with it, even
    if it crashes. If the context exits with an exception, they are killed immediately.

    Args:
        max_workers: Number of workers.
        mp_context: Start method; spawn by default, since Numba and BLAS may hang in a process
            forked from one with threads.
        initializer: Picklable function that each worker calls first.
        initargs: Arguments of `initializer`.
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
        # At exit, Python waits for workers that ignore its signal, so kill them first.
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
            # If a worker has already ended, its first call reports it.
            with contextlib.suppress(OSError):
                pipe.send((initializer, tuple(initargs)))
            self._free.put((pipe, process))

    @property
    def alive(self) -> bool:
        """Whether all workers are running."""
        return not self._killed and all(process.is_alive() for process in self._processes)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Returns a future of `fn(*args, **kwargs)`; function, arguments and result are pickled."""
        return self._threads.submit(self._call, fn, args, kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Ends the workers when their work is done."""
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        if wait:
            while not self._free.empty():
                pipe, _ = self._free.get()
                # Forked workers inherit copies of the pipe, so closing it does not reach them.
                with contextlib.suppress(OSError):
                    pipe.send(None)
                pipe.close()
            for process in self._processes:
                process.join()

    def kill(self) -> None:
        """Kills the workers immediately; pending results become exceptions."""
        self._killed = True
        for process in self._processes:
            with contextlib.suppress(ValueError):
                process.kill()

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if error is not None:
            self.kill()
        self.shutdown(cancel_futures=error is not None)

    def _call(self, fn: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        """Calls a function in the next free worker; runs in a thread."""
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
    """Starts a process that receives no signal before it ignores signals.

    Ctrl-C and `timeout` send signals to all processes of a group. Arguments of the process should
    be small: if they exceed the pipe's buffer and the reader ends, this process waits forever.
    """
    # Starting the resource tracker unblocks SIGINT and SIGTERM, so it must come first.
    resource_tracker.ensure_running()
    with signals_deferred():
        process.start()


def end_with(parent: int) -> None:
    """Makes this process end with its parent, even on a crash, and ignore signals."""
    for number in _ENDING:
        signal.signal(number, signal.SIG_IGN)
    with contextlib.suppress(AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        # the parent ended before prctl took effect
        os._exit(1)


def kill_at_exit(process: BaseProcess) -> None:
    """Kills a process when this one ends, before Python waits for it."""
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
            # The result cannot be pickled.
            pipe.send((False, RuntimeError(f"{type(error).__name__}: {error}")))
