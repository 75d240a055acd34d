"""Command-line arguments of benchmarks."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import NoReturn

from drake_dress.errors import UserError
from drake_dress.file_output import output_file as output_file
from drake_dress.file_output import output_folder as output_folder

UNUSABLE = 2


class OneLineParser(argparse.ArgumentParser):
    """An argument parser with one-line errors; `prog` is `drake-dress bench NAME`."""

    def error(self, message: str) -> NoReturn:
        """Exits with the message in one line."""
        self.exit(UNUSABLE, f"{self.prog.replace(' ', ': ', 1)}: {message}\n")


def bench_parser(name: str, text: str | None) -> OneLineParser:
    """Returns the parser of `drake-dress bench NAME`, whose help shows `text` verbatim."""
    return OneLineParser(
        prog=f"drake-dress bench {name}",
        description=text,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def exit_with(main: Callable[[], int]) -> NoReturn:
    """Exits with the status of a benchmark's `main`; prints one line on unusable input."""
    try:
        sys.exit(main())
    except UserError as error:
        print(f"drake-dress: {error}", file=sys.stderr)
        sys.exit(UNUSABLE)


def some_of(known: Sequence[str]) -> Callable[[str], list[str]]:
    """Returns an argparse type for comma-separated names from `known`."""

    def parse(text: str) -> list[str]:
        names = text.split(",")
        for name in names:
            if name not in known:
                raise argparse.ArgumentTypeError(f"{name!r} is none of {', '.join(known)}")
        return names

    return parse


def number_between(low: float, high: float) -> Callable[[str], float]:
    """Returns an argparse type for a number from `low` to `high`."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text!r} is none of {low:g} to {high:g}")
        return value

    return parse


def seed_number(text: str) -> int:
    """Parses a random seed; an argparse type."""
    if not text.isdecimal() or int(text) >= 2**63:
        raise argparse.ArgumentTypeError(f"{text!r} is no seed, expected 0 to 2^63 - 1")
    return int(text)


def at_least_one(text: str) -> int:
    """Parses a count of at least 1; an argparse type."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no count, expected 1 or more")
    return int(text)
