"""The section of a document that a benchmark writes, delimited by two marks."""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_dress.errors import UserError
from drake_dress.file_output import write_text

END = "<!-- end -->"


def begin(benchmark: str) -> str:
    """Returns the mark before a benchmark's section."""
    return f"<!-- bench {benchmark} -->"


def add_into_option(parser: argparse.ArgumentParser, benchmark: str) -> None:
    """Adds `--into`, the file that has a benchmark's tables between marks."""
    parser.add_argument(
        "--into",
        type=Path,
        metavar="FILE.md",
        help=f"put the tables between {begin(benchmark)} and {END}",
    )


def write_between(path: Path, benchmark: str, text: str) -> None:
    """Writes text between the two marks of a file.

    Raises:
        UserError: The file cannot be read, or lacks the marks.
    """
    before, after = around(path, benchmark)
    write_text(path, f"{before}{begin(benchmark)}\n\n{text}\n\n{END}{after}")


def around(path: Path, benchmark: str) -> tuple[str, str]:
    """Returns the content of a file before and after the marks.

    Raises:
        UserError: The file cannot be read, or lacks the marks.
    """
    try:
        content = path.read_text(encoding="utf-8")
    except OSError as error:
        raise UserError(str(path), "", f"cannot be read: {error.strerror}") from None
    mark = begin(benchmark)
    before, _, rest = content.partition(mark)
    _, _, after = rest.partition(END)
    if content.count(mark) != 1 or END not in rest:
        raise UserError(str(path), "", f"expected one {mark}, and one {END} after it")
    return before, after
