"""Standard streams that never end a command.

The reader of a pipe may stop (`| head -1`), a terminal may close, the disk may be full when output
is redirected to a file, and an encoding may lack a character. None of this should end a simulation,
whose results are in files. Output that cannot be shown is dropped or escaped.
"""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

# No reader: a closed pipe or terminal.
_UNREAD = (errno.EPIPE, errno.EIO)


@contextmanager
def forgiving_streams() -> Iterator[None]:
    """Prevents failures of `print`, and of the final flush when Python ends."""
    before = sys.stdout, sys.stderr
    shown = [None if stream is None else _Forgiving(stream) for stream in before]
    # A closed stream is None in Python; `print` ignores it.
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
    """Opens descriptors 0, 1 and 2 if they are closed, so that no file gets their numbers.

    Otherwise libraries that write to descriptor 1 or 2 would write into that file.
    """
    with contextlib.suppress(OSError):
        number = os.open(os.devnull, os.O_RDWR)
        while number <= 2:
            number = os.dup(number)
        os.close(number)


class _Forgiving:
    """A text stream whose writes do not fail; other attributes are the wrapped stream's.

    Attributes:
        lost: Reason why output was dropped; None if none was.
    """

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self.lost: OSError | None = None

    def write(self, text: str) -> int:
        """Writes text; escapes characters that the encoding lacks, drops text on failure."""
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
        """Writes the lines in order."""
        for line in lines:
            self.write(line)

    def flush(self) -> None:
        """Flushes; on failure drops the output."""
        if self.lost is None:
            try:
                self._stream.flush()
            except ValueError:  # closed
                return
            except OSError as error:
                self._lose(error)

    def _lose(self, error: OSError) -> None:
        """Discards all further output of this stream."""
        self.lost = error
        # At exit, Python flushes its buffer to the descriptor, which must accept it.
        with contextlib.suppress(OSError, ValueError):
            sink = os.open(os.devnull, os.O_WRONLY)
            os.dup2(sink, self._stream.fileno())
            os.close(sink)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
