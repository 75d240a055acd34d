"""Ctrl-C as a flag, so that a loop ends between two steps and nothing is lost."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def caught_interrupt() -> Iterator[threading.Event]:
    """Yields an event that the first Ctrl-C sets; a second one interrupts as usual.

    Python raises KeyboardInterrupt wherever it happens to be, which may be a callback whose
    exceptions are swallowed; a loop that looks at the event cannot miss it. Off the main thread,
    where no handler can be set, the event stays unset.
    """
    event = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield event
        return
    usual = signal.getsignal(signal.SIGINT)

    def on_interrupt(_number: int, _frame: object) -> None:
        event.set()
        signal.signal(signal.SIGINT, usual)

    signal.signal(signal.SIGINT, on_interrupt)
    try:
        yield event
    finally:
        signal.signal(signal.SIGINT, usual)
