"""A release is confirmed by a word, and by no other."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from typing import TextIO

import pytest

from drake_dress.diagrams.confirmation import WORD, Confirmation


@pytest.fixture
def line() -> Iterator[tuple[TextIO, TextIO]]:
    """Ends of a pipe: to read from, and to write to."""
    read, write = os.pipe()
    with os.fdopen(read, "r") as source, os.fdopen(write, "w", buffering=1) as sink:
        yield source, sink


def test_only_the_word_confirms(line: tuple[TextIO, TextIO]) -> None:
    source, sink = line
    told: list[str] = []
    confirm = Confirmation(source, told=told.append)
    assert not confirm(), "it does not wait for an answer"
    for other in ("\n", "yes\n", "hold\n"):
        sink.write(other)
        assert not confirm()
    sink.write(f"  {WORD.upper()} \n")
    assert confirm()
    assert len(told) == 1
    assert WORD in told[0]


def test_the_end_of_input_confirms_nothing(line: tuple[TextIO, TextIO]) -> None:
    source, sink = line
    confirm = Confirmation(source, told=lambda _: None)
    sink.close()
    assert [confirm() for _ in range(3)] == [False] * 3


def test_input_that_cannot_be_waited_for_confirms_nothing() -> None:
    confirm = Confirmation(io.StringIO(f"{WORD}\n"), told=lambda _: None)
    assert not confirm()
