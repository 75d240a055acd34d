"""Reads a CSV file into a header and a table of numbers, in the dialects of spreadsheets."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray

# Largest file, bytes: 600 s of 60 markers at 100 Hz are 0.1 GB.
_MOST_BYTES = 2**29
_COMMA_NUMBER = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?")
_NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|nan|inf(inity)?)", re.ASCII | re.I)


def read_table(path: Path) -> tuple[list[str], list[list[str]], list[int]]:
    """Returns the header, the cells of each row as text, and the rows' line numbers in the file.

    Reads UTF-8 and UTF-16, with or without a byte order mark, and Latin-1. Columns are separated by
    commas, semicolons or tabs. Empty lines are skipped.

    Raises:
        UserError: the file is not such a table, or a column name is repeated.
    """
    source = str(path)
    text = _decoded(path).replace("\r\n", "\n").replace("\r", "\n")
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        raise UserError(source, f"line {line}", "holds a NUL character, expected text")
    first, _, rest = text.partition("\n")
    begins = 1
    if re.fullmatch(r"sep=.", first):
        divider, text, begins = first[4], rest, 2
    else:
        divider = max(";,\t", key=first.count)
    rows, lines = [], []
    reader = csv.reader(io.StringIO(text), delimiter=divider, strict=True)
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                rows.append(row)
                lines.append(reader.line_num + begins - 1)
    except csv.Error as error:
        line = reader.line_num + begins - 1
        raise UserError(source, f"line {line}", f"cannot be read as CSV: {error}") from error
    if len(rows) < 2:
        raise UserError(source, "", "is empty, expected a header and a row a sample")
    header = [h.strip().lstrip("/") for h in rows[0]]
    _check_shape(source, header, rows[1:], lines[1:])
    return header, rows[1:], lines[1:]


def _check_shape(source: str, header: list[str], rows: list[list[str]], lines: list[int]) -> None:
    """Raises UserError if a column name is repeated, or a row is not as long as the header."""
    for k, name in enumerate(header):
        if name and name in header[:k]:
            raise UserError(source, name, "column stands twice, expected each name once")
    for row, line in zip(rows, lines, strict=True):
        if len(row) != len(header):
            raise UserError(
                source, f"line {line}", f"has {len(row)} values, expected {len(header)}"
            )


def numbers(
    source: str, header: list[str], rows: list[list[str]], lines: list[int], columns: list[int]
) -> FloatArray:
    """Returns (T,k) the numbers in the given columns, NaN for empty cells.

    Decimal commas are read if no cell of these columns has a decimal point.

    Raises:
        UserError: a cell is not a number.
    """
    table = np.full((len(rows), len(columns)), np.nan)
    point = any("." in row[j] for row in rows for j in columns)
    for i, row in enumerate(rows):
        for k, j in enumerate(columns):
            text = row[j].strip()
            if not text:
                continue
            if not point and _COMMA_NUMBER.fullmatch(text):
                text = text.replace(",", ".")
            if not _NUMBER.fullmatch(text):
                shown = row[j] if len(row[j]) <= 40 else row[j][:37] + "..."
                raise UserError(
                    source, f"line {lines[i]}", f"{header[j]} is {shown!r}, expected a number"
                )
            table[i, k] = float(text)
    return table


def column(source: str, header: list[str], name: str) -> int:
    """Returns the index of a column.

    Raises:
        UserError: there is no column of that name.
    """
    if name not in header:
        raise UserError(source, name, "column is missing")
    return header.index(name)


def _decoded(path: Path) -> str:
    source = str(path)
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise UserError(source, "", f"is larger than {_MOST_BYTES / 2**30:g} GB")
        content = path.read_bytes()
    except OSError as error:
        raise UserError(source, "", f"cannot be read: {error.strerror or error}") from error
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        coding = "utf-16"
    elif content[:64].count(0) >= 16:
        # UTF-16 without a byte order mark: every other byte of the header is 0
        coding = "utf-16-le" if content[1:2] == b"\0" else "utf-16-be"
    else:
        coding = "utf-8-sig"
    try:
        return content.decode(coding)
    except UnicodeDecodeError:
        if coding != "utf-8-sig":
            raise UserError(source, "", "is not text, expected CSV in UTF-8") from None
    # names and numbers are ASCII, so the meaning of other bytes does not matter
    return content.decode("latin-1")
