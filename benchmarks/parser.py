"""Arguments of a benchmark."""

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
    """An argument parser whose errors are one line; `prog` is `drake-dress bench NAME`."""

    def error(self, message: str) -> NoReturn:
        """Ends with the message in one line."""
        self.exit(UNUSABLE, f"{self.prog.replace(' ', ': ', 1)}: {message}\n")


def bench_parser(name: str, text: str | None) -> OneLineParser:
    """Returns the parser of `drake-dress bench NAME`, whose help is `text` as it stands."""
    return OneLineParser(
        prog=f"drake-dress bench {name}",
        description=text,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def exit_with(main: Callable[[], int]) -> NoReturn:
    """Ends with the status of a benchmark's `main`, and with one line where input is unusable."""
    try:
        sys.exit(main())
    except UserError as error:
        print(f"drake-dress: {error}", file=sys.stderr)
        sys.exit(UNUSABLE)


def some_of(known: Sequence[str]) -> Callable[[str], list[str]]:
    """Returns what parses names from `known` with commas between, for argparse."""

    def parse(text: str) -> list[str]:
        names = text.split(",")
        for name in names:
            if name not in known:
                raise argparse.ArgumentTypeError(f"{name!r} is none of {', '.join(known)}")
        return names

    return parse


def number_between(low: float, high: float) -> Callable[[str], float]:
    """Returns what parses a number from `low` to `high`, for argparse."""

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
    """Returns what may begin a draw, for argparse."""
    if not text.isdecimal() or int(text) >= 2**63:
        raise argparse.ArgumentTypeError(f"{text!r} is no seed, expected 0 to 2^63 - 1")
    return int(text)


def at_least_one(text: str) -> int:
    """Returns a count, for argparse."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no count, expected 1 or more")
    return int(text)
