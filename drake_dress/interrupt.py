"""Handles the signals that end a command, so that a loop ends between steps without data loss.

Ctrl-C (SIGINT), SIGTERM (from `kill`, or a cluster or container that ends a job) and SIGHUP (a
closed terminal) are treated alike. The exit status is 128 plus the signal's number, as in shells.
"""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_WORDS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated", signal.SIGHUP: "hung up"}
# Delay after which a signal that came during an import is sent again, s.
_LATER = 0.05
_IMPORTS = "<frozen importlib._bootstrap>"


class Terminated(KeyboardInterrupt):
    """Raised by SIGTERM or SIGHUP, as KeyboardInterrupt is by SIGINT."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class Interrupt(threading.Event):
    """Event that is set by the first signal that ends a command.

    Attributes:
        number: Number of that signal; SIGINT before any signal.
    """

    def __init__(self) -> None:
        super().__init__()
        self.number: int = signal.SIGINT

    @property
    def status(self) -> int:
        """Exit status of a command ended by the signal."""
        return 128 + self.number

    @property
    def word(self) -> str:
        """Word for the signal's effect, for the user."""
        return _WORDS[signal.Signals(self.number)]

    def error(self) -> KeyboardInterrupt:
        """Returns the exception for the signal."""
        return KeyboardInterrupt() if self.number == signal.SIGINT else Terminated(self.number)


def interrupt_of(error: KeyboardInterrupt) -> Interrupt:
    """Returns the interrupt of the signal that raised an exception."""
    interrupt = Interrupt()
    interrupt.number = error.number if isinstance(error, Terminated) else signal.SIGINT
    return interrupt


@contextmanager
def caught_interrupt() -> Iterator[Interrupt]:
    """Yields an event that the first signal sets; a second signal interrupts as usual.

    Python may raise KeyboardInterrupt in a callback whose exceptions are swallowed; a loop that
    checks the event cannot miss it. Outside the main thread no handler can be set, and the event
    stays unset. Ignored signals, such as SIGHUP under nohup, stay ignored.
    """
    event = Interrupt()

    def on_signal(number: int, _frame: object) -> None:
        event.number = number
        event.set()
        restore()

    with _handled(on_signal) as restore:
        yield event


@contextmanager
def signals_raised() -> Iterator[None]:
    """Makes signals that end a command raise an exception, so that files are closed.

    During an import the signal is deferred, because modules would report the exception as a failed
    import. If the exception is swallowed, as in `__del__` or during garbage collection, it is
    raised again shortly afterwards.
    """
    over = False

    def send_later(number: int) -> None:
        time.sleep(_LATER)
        if not over:
            os.kill(os.getpid(), number)

    def on_signal(number: int, frame: FrameType | None) -> None:
        if over:
            return
        if _importing(frame):
            # `threading.Thread` would take locks that the interrupted code may hold.
            _thread.start_new_thread(send_later, (number,))
            return
        interrupt = Interrupt()
        interrupt.number = number
        raise interrupt.error()

    usual = sys.unraisablehook

    def on_swallowed(swallowed: sys.UnraisableHookArgs) -> None:
        if isinstance(swallowed.exc_value, KeyboardInterrupt):
            number = interrupt_of(swallowed.exc_value).number
            _thread.start_new_thread(send_later, (number,))
        else:
            usual(swallowed)

    try:
        with _handled(on_signal):
            sys.unraisablehook = on_swallowed
            yield
            over = True
    finally:
        over = True
        sys.unraisablehook = usual


def _importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == _IMPORTS:
            return True
        frame = frame.f_back
    return False


@contextmanager
def signals_deferred() -> Iterator[None]:
    """Defers signals that end a command during an operation that must not be left half done.

    A process started in this context inherits the blocked signals. In this process another thread
    may still receive a signal, so the handlers only record it.
    """
    came: list[int] = []
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)
    try:
        with _handled(lambda number, _: came.append(number)):
            yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if came:
            signal.raise_signal(came[0])


@contextmanager
def _handled(
    handler: Callable[[int, Any], None], numbers: tuple[signal.Signals, ...] = _ENDING
) -> Iterator[Callable[[], None]]:
    """Sets a handler; yields a function that restores the former ones, as the exit does."""
    if threading.current_thread() is not threading.main_thread():
        yield lambda: None
        return
    usual = {
        number: found
        for number in numbers
        if (found := signal.getsignal(number)) is not None
        and (found is not signal.SIG_IGN or number == signal.SIGINT)
    }

    def restore() -> None:
        for number, former in usual.items():
            signal.signal(number, former)

    for number in usual:
        signal.signal(number, handler)
    try:
        yield restore
    finally:
        restore()
