"""Classes that users register by name: effects, costs."""

from __future__ import annotations

import re
from typing import Any

from drake_dress.errors import UserError

_NAME = re.compile(r"[a-z][a-z0-9_]*")


def is_name(text: Any) -> bool:
    """Returns whether it can be a scenario's key: lower-case letters, digits and _."""
    return isinstance(text, str) and _NAME.fullmatch(text) is not None


def check_name(source: str, kind: type, example: str) -> None:
    """Raises UserError, which names `source`, if the `NAME` of a class is not a valid name."""
    name = getattr(kind, "NAME", None)
    if not is_name(name):
        raise UserError(
            source, "NAME", f"is {name!r}, expected lower-case letters, digits and _, as {example}"
        )


def enter(register: dict[str, Any], source: str, kind: Any) -> None:
    """Enters a class under its `NAME`.

    A class that is defined again, as in a notebook's cell, replaces its earlier version.

    Raises:
        UserError: another class has the name.
    """
    name: str = kind.NAME
    there = register.get(name)
    if there is not None and _place(there) != _place(kind):
        raise UserError(source, "NAME", f"is {name!r}, which {_place(there)} has, expected another")
    register[name] = kind


def _place(kind: type) -> str:
    """Returns where a class is defined."""
    return f"{kind.__module__}.{kind.__qualname__}"
