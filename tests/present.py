"""Narrows a value that may be None to one that is there."""

from typing import TypeVar

T = TypeVar("T")


def present(value: T | None) -> T:
    """Returns the value; the test fails where there is none."""
    assert value is not None
    return value
