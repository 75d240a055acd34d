"""Reads text files named by a user: regular files of limited size, in UTF-8."""

from __future__ import annotations

import codecs
import os
import stat
from pathlib import Path

from drake_dress.errors import UserError

# Far more than any scenario or table of poses; rejects a wrong file before it fills memory.
MAX_BYTES = 1 << 20
_OTHER_ENCODINGS = {
    codecs.BOM_UTF32_LE: "UTF-32",
    codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}


def read_text(path: Path, expected: str, max_bytes: int = MAX_BYTES) -> str:
    """Returns the text of a file, without a byte order mark.

    Args:
        path: Path of the file.
        expected: Expected content, for messages, such as "a scenario in YAML".
        max_bytes: Largest accepted size.

    Raises:
        UserError: The file does not exist, is not a regular file (a folder, pipe or device), is too
            large, or is not UTF-8.
    """
    source = str(path)
    try:
        # Without O_NONBLOCK, opening a pipe that has no writer would block.
        number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except (OSError, ValueError) as error:
        raise UserError(source, "", f"{_why_not(error)}, expected {expected}") from error
    mode = os.fstat(number).st_mode
    if not stat.S_ISREG(mode):
        os.close(number)
        kind = "a directory" if stat.S_ISDIR(mode) else "no regular file"
        raise UserError(source, "", f"is {kind}, expected {expected}")
    with open(number, "rb") as file:
        try:
            data = file.read(max_bytes + 1)
        except OSError as error:
            raise UserError(source, "", f"cannot be read: {error.strerror}") from error
    if len(data) > max_bytes:
        message = f"is larger than {max_bytes >> 20} MB, expected {expected}"
        raise UserError(source, "", message)
    for mark, encoding in _OTHER_ENCODINGS.items():
        if data.startswith(mark):
            raise UserError(source, "", f"is text in {encoding}, expected UTF-8: save it as that")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        message = f"line {line} is not text in UTF-8, expected {expected}"
        raise UserError(source, "", message) from error
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise UserError(source, f"line {line}", f"holds a NUL byte, expected {expected}")
    return text


def _why_not(error: OSError | ValueError) -> str:
    if isinstance(error, FileNotFoundError):
        return "no such file"
    reason = error.strerror if isinstance(error, OSError) else str(error)
    return f"cannot be read: {reason}"
