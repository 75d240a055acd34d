"""Arguments of a benchmark."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import NoReturn

UNUSABLE, INTERRUPTED = 2, 130


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors are one line; `prog` is `drake-dress bench NAME`."""

    def error(self, message: str) -> NoReturn:
        """Ends with the message in one line."""
        self.exit(UNUSABLE, f"{self.prog.replace(' ', ': ', 1)}: {message}\n")


def some_of(known: Sequence[str]) -> Callable[[str], list[str]]:
    """Returns what parses names from `known` with commas between, for argparse."""

    def parse(text: str) -> list[str]:
        names = text.split(",")
        for name in names:
            if name not in known:
                raise argparse.ArgumentTypeError(f"{name!r} is none of {', '.join(known)}")
        return names

    return parse
