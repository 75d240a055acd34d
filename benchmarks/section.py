"""The part of a document that a benchmark writes: what stands between two marks."""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_dress.errors import UserError
from drake_dress.file_output import write_text

END = "<!-- end -->"


def begin(benchmark: str) -> str:
    """Returns the mark before the part of a benchmark."""
    return f"<!-- bench {benchmark} -->"


def add_into_option(parser: argparse.ArgumentParser, benchmark: str) -> None:
    """Adds `--into`, the file in which a benchmark's tables stand between marks."""
    parser.add_argument(
        "--into",
        type=Path,
        metavar="FILE.md",
        help=f"put the tables between {begin(benchmark)} and {END}",
    )


def write_between(path: Path, benchmark: str, text: str) -> None:
    """Puts text between the two marks of a file.

    Raises:
        UserError: the file cannot be read, or lacks them.
    """
    before, after = around(path, benchmark)
    write_text(path, f"{before}{begin(benchmark)}\n\n{text}\n\n{END}{after}")


def around(path: Path, benchmark: str) -> tuple[str, str]:
    """Returns what a file holds before and after the marks.

    Raises:
        UserError: the file cannot be read, or lacks them.
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
