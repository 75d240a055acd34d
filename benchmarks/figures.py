"""What a benchmark writes with `--json`: its tables, and beside them the figures that count.

Every file holds `figures` (name, value, unit, asked, met), `machine`, `version` and `seeds`. A
figure that the file's results do not give is not in the list.
"""

from __future__ import annotations

import json
import math
import os
import platform
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from drake_dress import __version__
from drake_dress.file_output import write_text


@dataclass(frozen=True)
class Figure:
    """One figure beside what is asked.

    Attributes:
        name: what was measured.
        value: the measured value.
        unit: of value and asked.
        asked: bound that the value has to keep; None where nothing is asked.
        met: whether it keeps it; None where nothing is asked.
    """

    name: str
    value: float
    unit: str
    asked: float | None = None
    met: bool | None = None


def at_most(name: str, value: float, unit: str, asked: float) -> Figure:
    """Returns a figure that may not exceed `asked`."""
    return Figure(name, value, unit, asked, bool(value <= asked))


def at_least(name: str, value: float, unit: str, asked: float) -> Figure:
    """Returns a figure that has to reach `asked`."""
    return Figure(name, value, unit, asked, bool(value >= asked))


def every(name: str, right: int, count: int) -> Figure:
    """Returns how many of `count` are right, all of which have to be."""
    return Figure(name, right, f"of {count}", count, right == count)


def heading(figures: Iterable[Figure], seeds: Sequence[int]) -> dict[str, Any]:
    """Returns what every benchmark's file holds beside its own results."""
    return {
        "figures": [asdict(f) for f in figures],
        "machine": machine(),
        "version": __version__,
        "seeds": list(seeds),
    }


def write_figures(
    path: Path, figures: Iterable[Figure], seeds: Sequence[int], **results: Any
) -> None:
    """Writes figures and results as JSON; NaN and infinity become null."""
    document = plain(heading(figures, seeds) | results)
    write_text(path, json.dumps(document, indent=1, allow_nan=False) + "\n")


def machine() -> dict[str, Any]:
    """Returns processor, cores, system and Python."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
    }


def plain(value: Any) -> Any:
    """Returns `value` as JSON has it: NaN and infinity become null."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
