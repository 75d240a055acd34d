"""Tables as plain text that is also Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Table:
    """A title, a header and rows of cells, formatted by `shown`."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[Any]]

    def text(self) -> str:
        """Returns the table with aligned columns."""
        cells = [[shown(cell) for cell in row] for row in self.rows]
        lines = [list(self.header), *cells]
        width = [max(len(line[k]) for line in lines) for k in range(len(self.header))]

        def row(line: Sequence[str]) -> str:
            first = line[0].ljust(width[0])
            rest = [cell.rjust(w) for cell, w in zip(line[1:], width[1:], strict=True)]
            return "| " + " | ".join([first, *rest]) + " |"

        rule = "| " + " | ".join("-" * w for w in width) + " |"
        return "\n".join([self.title, "", row(lines[0]), rule, *map(row, cells)])


def shown(cell: Any) -> str:
    """Returns a cell as text: numbers with three digits, missing values as a dash."""
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return "–"
    if isinstance(cell, float):
        if cell == 0.0:
            return "0"
        digits = max(0, 2 - math.floor(math.log10(abs(cell)))) if math.isfinite(cell) else 0
        return f"{cell:.{min(digits, 6)}f}"
    return str(cell)


def milliseconds(seconds: float | None) -> float | None:
    """Returns a time in ms for a cell."""
    return None if seconds is None else 1e3 * seconds
