"""Standard output and errors that never end a command.

Who reads a pipe may stop (`| head -1`), a terminal may close, a disk that output is redirected to
may be full, and an encoding may lack a character. None of this is a reason to end a simulation: its
results are in files. What cannot be shown is dropped, or escaped.
"""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

# Nobody reads any more: a closed pipe, or a terminal that is gone.
_UNREAD = (errno.EPIPE, errno.EIO)


@contextmanager
def forgiving_streams() -> Iterator[None]:
    """Has `print` neither fail nor leave anything behind that fails when Python ends."""
    before = sys.stdout, sys.stderr
    shown = [None if stream is None else _Forgiving(stream) for stream in before]
    # Python has None where a stream is closed, which `print` passes over.
    sys.stdout, sys.stderr = shown
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
        for stream in shown:
            if stream is not None:
                stream.flush()
        lost = shown[0].lost if shown[0] is not None else None
        if lost is not None and lost.errno not in _UNREAD and shown[1] is not None:
            shown[1].write(f"drake-dress: standard output: {lost.strerror}\n")


def keep_standard_descriptors() -> None:
    """Opens what is closed of descriptors 0, 1 and 2, so that no file gets their numbers.

    Libraries that write to descriptor 1 or 2 would write into that file.
    """
    with contextlib.suppress(OSError):
        number = os.open(os.devnull, os.O_RDWR)
        while number <= 2:
            number = os.dup(number)
        os.close(number)


class _Forgiving:
    """A text stream whose writes do not fail; all else is the stream's own.

    Attributes:
        lost: why output was dropped; None while none was.
    """

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self.lost: OSError | None = None

    def write(self, text: str) -> int:
        """Writes, escapes what the encoding lacks, drops what cannot be written."""
        if self.lost is None:
            try:
                try:
                    self._stream.write(text)
                except UnicodeEncodeError:
                    encoding = self._stream.encoding or "ascii"
                    self._stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
            except OSError as error:
                self._lose(error)
        return len(text)

    def writelines(self, lines: Any) -> None:
        """Writes one after the other."""
        for line in lines:
            self.write(line)

    def flush(self) -> None:
        """Flushes, or drops what cannot be written."""
        if self.lost is None:
            try:
                self._stream.flush()
            except ValueError:  # closed
                return
            except OSError as error:
                self._lose(error)

    def _lose(self, error: OSError) -> None:
        """From now on, what goes to this stream goes nowhere."""
        self.lost = error
        # Python flushes its buffer at its end; that goes to the descriptor, which must take it.
        with contextlib.suppress(OSError, ValueError):
            sink = os.open(os.devnull, os.O_WRONLY)
            os.dup2(sink, self._stream.fileno())
            os.close(sink)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
