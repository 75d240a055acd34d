"""Results of benchmarks kept in a file, from which a long study is resumed."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from benchmarks.figures import Figure, heading, plain
from drake_dress.errors import UserError
from drake_dress.file_output import write_text


def read_results(
    path: Path, name_of: Callable[[dict[str, Any]], str], benchmark: str
) -> dict[str, dict[str, Any]]:
    """Returns the results in a file by name of the case; empty if there is no file.

    Args:
        path: Path of the file.
        name_of: Returns a case's name from the fields under "case" of a result.
        benchmark: Name of the benchmark, for errors.

    Raises:
        UserError: The file cannot be read, or has other content.
    """
    if not path.exists():
        return {}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        # files of earlier versions hold the results alone
        runs = found["runs"] if isinstance(found, dict) else found
        return {name_of(result["case"]): result for result in runs}
    except OSError as error:
        raise UserError(str(path), "", f"cannot be read: {error.strerror}") from None
    except (ValueError, TypeError, KeyError):
        raise UserError(
            str(path), "", f"expected results of drake-dress bench {benchmark}"
        ) from None


def write_results(
    path: Path, results: Mapping[str, dict[str, Any]], figures: Iterable[Figure] = ()
) -> None:
    """Writes results, a line each, in the order of their cases' names, below their figures."""
    seeds = {r["case"]["seed"] for r in results.values() if "seed" in r["case"]}
    above = json.dumps(plain(heading(figures, sorted(seeds))), indent=1, allow_nan=False)
    lines = ",\n".join(json.dumps(results[name]) for name in sorted(results))
    write_text(path, f'{above.removesuffix(chr(10) + "}")},\n "runs": [\n{lines}\n]}}\n')


def seed_range(text: str) -> range:
    """Parses a range of seeds, A-B or A; an argparse type."""
    first, _, last = text.partition("-")
    last = last or first
    if not (first.isdecimal() and last.isdecimal() and int(first) <= int(last)):
        raise argparse.ArgumentTypeError(f"{text!r} is no range such as 0-9")
    return range(int(first), int(last) + 1)
