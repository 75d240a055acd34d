"""Immutable values of abstract state."""

from __future__ import annotations

from typing import Any, Self


class Immutable:
    """Is its own copy. Drake copies all abstract state at every unrestricted update.

    For frozen dataclasses whose arrays are never written to.
    """

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self
