"""Functions are short and take few arguments; the exceptions are listed with their reasons."""

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
MOST_LINES, MOST_ARGUMENTS, MOST_EXCEPTIONS = 60, 8, 5
# Decorators of compiled kernels, which call nothing that would cost at run time.
KERNELS = ("njit", "vectorised", "intrinsic", "cfunc", "wp.")

LONG = {
    "drake_dress/models/cloth/explicit/explicit_bias.py: step": "half of it is its docstring; "
    "the steps of the scheme share ten arrays",
}
MANY_ARGUMENTS = {
    "drake_dress/models/garment/load.py: load_garment": "the options of a mesh file as keywords, "
    "for Python users; they become one MeshOptions",
    "drake_dress/systems/run_recorder.py: __init__": "a Drake system: sizes of ports and rates",
    "drake_dress/systems/outbox.py: __init__": "a Drake system: channel, message, rate, faults",
    "drake_dress/systems/active_person.py: __init__": "a Drake system: person, motions and rates",
}


def functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    """Yields the functions of package, benchmarks and examples that are no compiled kernels."""
    for folder in ("drake_dress", "benchmarks", "examples"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.FunctionDef):
                    decorators = " ".join(map(ast.unparse, node.decorator_list))
                    if not any(word in decorators for word in KERNELS):
                        yield f"{path.relative_to(ROOT)}: {node.name}", node


def test_functions_are_short() -> None:
    lines = {name: (n.end_lineno or n.lineno) - n.lineno + 1 for name, n in functions()}
    assert {name for name, count in lines.items() if count > MOST_LINES} == set(LONG)
    assert len(LONG) <= MOST_EXCEPTIONS


def test_functions_take_few_arguments() -> None:
    many = set()
    for name, node in functions():
        a = node.args
        taken = [*a.posonlyargs, *a.args, *a.kwonlyargs]
        bound = bool(taken) and taken[0].arg in ("self", "cls")
        if len(taken) - bound > MOST_ARGUMENTS:
            many.add(name)
    assert many == set(MANY_ARGUMENTS)
    assert len(MANY_ARGUMENTS) <= MOST_EXCEPTIONS
