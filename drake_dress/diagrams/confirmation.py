"""Asks a person at the robot whether the grippers may open."""

from __future__ import annotations

import select
import sys
from collections.abc import Callable
from typing import TextIO

from pydrake.geometry import Meshcat

WORD = "release"
_BUTTON = "release the coat"


class Confirmation:
    """Whether the word `release` was entered, or the button on the Meshcat page was clicked.

    Args:
        source: where the word is read from, line by line.
        page: Meshcat page that shows a button, if any.
        told: called with the question.
    """

    def __init__(
        self,
        source: TextIO | None = None,
        page: Meshcat | None = None,
        told: Callable[[str], None] = print,
    ) -> None:
        self._source = sys.stdin if source is None else source
        self._page, self._told = page, told
        self._asked = self._ended = False

    def __call__(self) -> bool:
        """Returns whether the release is confirmed; the first call asks for it."""
        if not self._asked:
            self._asked = True
            button = "" if self._page is None else f", or click '{_BUTTON}' on the live page"
            self._told(
                f"the coat is laid: enter '{WORD}' to open the grippers{button}; "
                "until then they hold it"
            )
            if self._page is not None:
                self._page.AddButton(_BUTTON)
        return self._is_clicked() or self._is_entered()

    def _is_clicked(self) -> bool:
        return self._page is not None and self._page.GetButtonClicks(_BUTTON) > 0

    def _is_entered(self) -> bool:
        """Returns whether a waiting line is the word; never waits for one."""
        while not self._ended:
            try:
                ready = bool(select.select([self._source], [], [], 0.0)[0])
            except (OSError, ValueError):
                # closed, or not a file that can be waited for
                self._ended = True
                return False
            if not ready:
                return False
            line = self._source.readline()
            self._ended = not line
            if line.strip().lower() == WORD:
                return True
        return False
