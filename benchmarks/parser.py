"""Arguments of a benchmark."""

from __future__ import annotations

import argparse
from typing import NoReturn

UNUSABLE, INTERRUPTED = 2, 130


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors are one line; `prog` is `drake-dress bench NAME`."""

    def error(self, message: str) -> NoReturn:
        """Ends with the message in one line."""
        self.exit(UNUSABLE, f"{self.prog.replace(' ', ': ', 1)}: {message}\n")
