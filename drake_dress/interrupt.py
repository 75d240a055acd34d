"""Signals that end a command, as a flag: a loop ends between two steps and nothing is lost.

Ctrl-C (SIGINT), SIGTERM (from `kill`, a cluster or a container that ends a job) and SIGHUP (a
terminal that closes) are treated alike. The exit status is 128 plus the signal's number, as shells
have it.
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
# s from a signal that came inside an import to the next look whether it is over.
_LATER = 0.05
_IMPORTS = "<frozen importlib._bootstrap>"


class Terminated(KeyboardInterrupt):
    """SIGTERM or SIGHUP came where nothing catches it."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class Interrupt(threading.Event):
    """Is set by the first signal that ends a command.

    Attributes:
        number: of that signal; SIGINT while none came.
    """

    def __init__(self) -> None:
        super().__init__()
        self.number: int = signal.SIGINT

    @property
    def status(self) -> int:
        """Exit status of a command that the signal ended."""
        return 128 + self.number

    @property
    def word(self) -> str:
        """What the signal did, for the user."""
        return _WORDS[signal.Signals(self.number)]

    def error(self) -> KeyboardInterrupt:
        """Returns the exception that the signal raises where nothing catches it."""
        return KeyboardInterrupt() if self.number == signal.SIGINT else Terminated(self.number)


def interrupt_of(error: KeyboardInterrupt) -> Interrupt:
    """Returns what an exception tells of the signal that raised it."""
    interrupt = Interrupt()
    interrupt.number = error.number if isinstance(error, Terminated) else signal.SIGINT
    return interrupt


@contextmanager
def caught_interrupt() -> Iterator[Interrupt]:
    """Yields an event that the first signal sets; a second one interrupts as usual.

    Python raises KeyboardInterrupt wherever it happens to be, which may be a callback whose
    exceptions are swallowed; a loop that looks at the event cannot miss it. Off the main thread,
    where no handler can be set, the event stays unset. Signals that are ignored, such as SIGHUP
    under nohup, stay so.
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
    """Has signals that end a command raise an exception, so that files are closed.

    Inside an import they wait for its end: modules take an exception there for a failure of what
    they load, and tell it as that. Where an exception is swallowed, as in `__del__` or when memory
    is collected, it is raised again a little later.
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
            # A thread of `threading` would take locks that the interrupted code may hold.
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
    """Has signals that end a command wait, where half of what is done would be worse than none.

    A process that is started meanwhile inherits that they wait. In this one another thread may
    take a signal all the same, so handlers wait, too.
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
    """Sets a handler; yields what gives the former ones back, which the end does at the latest."""
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
