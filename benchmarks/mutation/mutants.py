"""Mutants of files: one small change each, by the operators of Cosmic Ray.

Changes of annotations and docstrings are excluded, since no test could catch them.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import unified_diff
from pathlib import Path

import numpy as np

from drake_dress.errors import UserError


@dataclass(frozen=True)
class Mutant:
    """One change of one file.

    Attributes:
        module: Name in `MODULES`.
        file: Path relative to the root of the repository.
        operator: Operator of Cosmic Ray.
        occurrence: Index of the operator's target among all its targets in the file.
    """

    module: str
    file: str
    operator: str
    occurrence: int

    @property
    def name(self) -> str:
        """Unique name of the mutant."""
        return f"{self.file}:{self.operator}:{self.occurrence}"


def all_mutants(module: str, file: str, root: Path) -> list[Mutant]:
    """Returns every mutant of a file, including those that no test could catch.

    Raises:
        UserError: Cosmic Ray is not installed.
    """
    try:
        from cosmic_ray.ast import ast_nodes, get_ast
        from cosmic_ray.plugins import get_operator, operator_names
    except ImportError:
        raise UserError(
            "bench", "mutation", "needs Cosmic Ray: pip install -e '.[mutation]'"
        ) from None
    nodes = list(ast_nodes(get_ast((root / file).read_text(encoding="utf-8"))))
    found = []
    for name in operator_names():
        operator = get_operator(name)
        if operator.arguments():
            continue
        count = sum(len(list(operator().mutation_positions(node))) for node in nodes)
        found += [Mutant(module, file, name, k) for k in range(count)]
    return found


def mutated(mutant: Mutant, root: Path) -> str | None:
    """Returns the mutant's source; None if no test could catch the change."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    source = (root / mutant.file).read_text(encoding="utf-8")
    code: str | None = mutate_code(source, get_operator(mutant.operator)(), mutant.occurrence)
    if code is None or _meaning(code) == _meaning(source):
        return None
    return code


def change(mutant: Mutant, code: str, root: Path) -> list[str]:
    """Returns the changed lines, the original ones first."""
    source = (root / mutant.file).read_text(encoding="utf-8")
    lines = unified_diff(source.splitlines(), code.splitlines(), n=0, lineterm="")
    return [line for line in list(lines)[2:]]


def draw(mutants: Sequence[Mutant], count: int, root: Path, seed: int) -> list[Mutant]:
    """Draws `count` mutants without replacement, or all if there are fewer."""
    order = np.random.default_rng(seed).permutation(len(mutants))
    chosen: list[Mutant] = []
    for k in order:
        if len(chosen) == count:
            break
        if mutated(mutants[k], root) is not None:
            chosen.append(mutants[k])
    return chosen


class _Bare(ast.NodeTransformer):
    """Removes annotations and docstrings."""

    def visit_arg(self, node: ast.arg) -> ast.AST:
        node.annotation = None
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        node.annotation = ast.Constant(None)
        return self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.returns = None
        return self.generic_visit(node)

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        if isinstance(node.value, ast.Constant):
            node.value = ast.Constant(None)
        return node


def _meaning(source: str) -> str:
    try:
        return ast.dump(_Bare().visit(ast.parse(source)))
    except SyntaxError:
        return ""
