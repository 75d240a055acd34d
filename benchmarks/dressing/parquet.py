"""Writes all runs of a study to one table, for other programs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.dressing.cases import Case
from drake_dress.errors import UserError


def write_table(
    path: Path, results: Sequence[dict[str, Any]], drawn: Callable[[Case], Mapping[str, float]]
) -> None:
    """Writes a row for each run: case, drawn numbers, summary.

    Args:
        path: Path of the Parquet file.
        results: Results of the runs, with summaries.
        drawn: Returns the numbers drawn by a run's seed.

    Raises:
        UserError: PyArrow is not installed.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise UserError(
            "bench", "--table", "PyArrow is not installed; pip install 'drake_dress[ray]'"
        ) from None
    rows = [row_of(result, drawn) for result in results]
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {name: [row.get(name) for row in rows] for name in names}
    unfinished = path.with_name(f".{path.name}.unfinished")
    pq.write_table(pa.table(columns), unfinished)
    unfinished.replace(path)


def row_of(
    result: Mapping[str, Any], drawn: Callable[[Case], Mapping[str, float]]
) -> dict[str, Any]:
    """Returns the columns of a run; keys of nested groups are joined by dots."""
    row: dict[str, Any] = dict(result["case"])
    row |= {f"drawn.{name}": value for name, value in drawn(Case(**result["case"])).items()}
    for name, value in result["summary"].items():
        if name == "seed":
            continue
        if isinstance(value, Mapping):
            row |= {
                f"{name}.{part}": number
                for part, number in value.items()
                if not isinstance(number, Mapping)
            }
        else:
            row[name] = value
    return row
