"""Which test file covers a module that has no test file of its own; measured by `make coverage`.

`tests/covered_by.json` maps each such module to the test file that runs most of its lines, or to
one that starts it in another process, where lines cannot be counted.
"""

from __future__ import annotations

import json
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]
TABLE = Path(__file__).with_name("covered_by.json")


def modules() -> list[str]:
    """Returns the modules of package and benchmarks, relative to the repository."""
    found = [p for folder in ("drake_dress", "benchmarks") for p in (ROOT / folder).rglob("*.py")]
    return sorted(str(p.relative_to(ROOT)) for p in found if p.name != "__init__.py")


def own_test(module: str) -> Path:
    """Returns the path at which a module's own test file would be."""
    parts = Path(module).parts
    folders = parts[1:-1] if parts[0] == "drake_dress" else parts[:-1]
    return ROOT.joinpath("tests", *folders, f"test_{parts[-1]}")


def without_own_test() -> list[str]:
    """Returns the modules that have no test file of their own."""
    return [m for m in modules() if not own_test(m).exists()]


def told() -> dict[str, str]:
    """Returns the table."""
    table: dict[str, str] = json.loads(TABLE.read_text(encoding="utf-8"))
    return table


def write_table(data_file: str = ".coverage") -> None:
    """Writes the table from coverage data with one context a test; keeps entries without data."""
    from coverage import CoverageData

    data = CoverageData(data_file)
    data.read()
    old = told() if TABLE.exists() else {}
    table = {}
    for module in without_own_test():
        lines: dict[str, set[int]] = defaultdict(set)
        for line, contexts in data.contexts_by_lineno(str(ROOT / module)).items():
            for context in contexts:
                if "::" in context:
                    lines[context.split("::")[0]].add(line)
        # among test files that run equally many lines, the one nearest to the module wins
        most = max(lines, key=lambda test: (len(lines[test]), _near(test, module)), default=None)
        table[module] = most or old.get(module, "")
    text = json.dumps(table, indent=1, sort_keys=True) + "\n"
    TABLE.write_text(text, encoding="utf-8")


def _near(test: str, module: str) -> int:
    """Returns how many leading folders a test file shares with the module's own would-be file."""
    there = own_test(module).relative_to(ROOT).parts
    here = Path(test).parts
    return next((i for i, (a, b) in enumerate(zip(here, there, strict=False)) if a != b), len(here))


if __name__ == "__main__":
    write_table()
