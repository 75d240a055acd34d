"""Narrows the type of a value that may be None."""

from typing import TypeVar

T = TypeVar("T")


def present(value: T | None) -> T:
    """Returns the value; the test fails if it is None."""
    assert value is not None
    return value
