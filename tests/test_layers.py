"""Imports between the parts of the package go one way."""

import ast
from pathlib import Path

import pytest

import drake_dress

PACKAGE = Path(drake_dress.__file__).parent
# From below to above: each part imports from itself and from parts before it.
LAYERS = ("models", "solvers", "report", "systems", "diagrams", "discrepancy", "learning", "gym")


def imported(path: Path) -> set[str]:
    """Returns the parts of the package that a file imports from."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module]
        found |= {n.split(".")[1] for n in names if n.startswith("drake_dress.")}
    return found & set(LAYERS)


@pytest.mark.parametrize("layer", LAYERS)
def test_no_part_imports_from_a_part_above_it(layer: str) -> None:
    files = list((PACKAGE / layer).rglob("*.py"))
    assert files
    allowed = set(LAYERS[: LAYERS.index(layer) + 1])
    wrong = {str(f.relative_to(PACKAGE)): imported(f) - allowed for f in files}
    assert not {name: parts for name, parts in wrong.items() if parts}


def test_every_part_of_the_package_has_its_layer() -> None:
    parts = {p.parent.name for p in PACKAGE.glob("*/__init__.py")}
    assert parts == set(LAYERS)
