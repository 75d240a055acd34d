"""Values of abstract state that nobody changes."""

from __future__ import annotations

from typing import Any, Self


class Immutable:
    """Is its own copy. Drake copies all abstract state at every unrestricted update.

    For frozen dataclasses whose arrays nobody writes to.
    """

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self
