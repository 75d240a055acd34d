"""Reads the text of mesh files: encodings, line ends and numbers."""

from __future__ import annotations

import codecs
import math
import re

from drake_dress.errors import UserError

_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
# Patterns of a number, and of three in brackets, which are groups.
NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
TRIPLE = rf"\(\s*({NUMBER})\s*,\s*({NUMBER})\s*,\s*({NUMBER})\s*\)"
_NUMBER = re.compile(NUMBER, re.ASCII)
_DECIMAL_COMMA = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?", re.ASCII)


def decoded(data: bytes, source: str) -> str:
    """Returns the text of a file.

    A byte order mark decides the encoding. Without one, zero bytes indicate UTF-16, and text that
    is not UTF-8 is read as Latin-1, which can only garble names.

    Raises:
        UserError: the file is not text.
    """
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), None)
    if encoding is None:
        encoding = _unmarked(data)
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        raise UserError(source, "", f"is not text ({encoding}), expected a mesh as text") from None
    if "\0" in text:
        raise UserError(source, "", "is not text (it holds zero bytes), expected a mesh as text")
    return text


def _unmarked(data: bytes) -> str:
    start = data[:1000]
    if 0 in start:
        if start[1::2].count(0) > 0.8 * len(start[1::2]):
            return "utf-16-le"
        if start[::2].count(0) > 0.8 * len(start[::2]):
            return "utf-16-be"
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def lines_of(text: str) -> list[str]:
    """Returns the lines of a text. Only LF, CR LF and CR end a line."""
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


class Numbers:
    """Reads the decimal numbers of one file, which uses points or commas throughout."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._point_line = 0  # the first line with a decimal point or comma; 0: none yet
        self._comma_line = 0

    def read(self, words: list[str], line: int) -> list[float]:
        """Returns finite numbers.

        Args:
            words: numbers as the file writes them.
            line: line of the file, for messages.

        Raises:
            UserError: a word is not a finite decimal number, or the file mixes points and commas.
        """
        return [self._number(word, line) for word in words]

    def _number(self, word: str, line: int) -> float:
        if _NUMBER.fullmatch(word):
            if "." in word and not self._point_line:
                self._point_line = line
        elif _DECIMAL_COMMA.fullmatch(word):
            word = word.replace(",", ".")
            self._comma_line = self._comma_line or line
        else:
            raise self._refusal(word, line)
        if self._point_line and self._comma_line:
            other = min(self._point_line, self._comma_line)
            raise UserError(
                self._source,
                f"line {line}",
                f"decimal points and decimal commas are mixed (see line {other}), expected one",
            )
        value = float(word)
        if not math.isfinite(value):
            raise UserError(
                self._source, f"line {line}", f"{word} is infinite, expected a finite number"
            )
        return value

    def _refusal(self, word: str, line: int) -> UserError:
        try:
            special = not math.isfinite(float(word))
        except ValueError:
            special = False
        what = "is NaN or infinity, expected a finite number" if special else "is not a number"
        return UserError(self._source, f"line {line}", f"{word[:40]!r} {what}")
