"""Pages that are made from the code: the reference of public modules, and all scenario keys.

They stand in `reference/` and `scenario_keys.md` and are not kept in git.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drake_dress.diagrams.scenario.key_table import markdown_table

REFERENCE = "reference"
KEYS = "scenario_keys.md"
_KEYS_INTRODUCTION = """# Every scenario key

A scenario is a YAML file. It names only what differs from the defaults below. `--set` sets a single
value by its dotted key:

```text
drake-dress run dummy_standing --set plant.material.friction=0.5 --set controller.method=full
```

The program refuses a key that does not exist, a value of the wrong type and a number out of range,
in one line that names the key. Both ends of a range are allowed. Units are SI except where the
table says otherwise. This page is made from the schema
(`drake_dress/diagrams/scenario/schema.py`) when the site is built.

"""


def write(modules: Sequence[str], folder: Path) -> None:
    """Writes all generated pages.

    Args:
        modules: dotted names of the public modules.
        folder: of the site's sources.
    """
    _write_if_new(folder / KEYS, _KEYS_INTRODUCTION + markdown_table())
    pages = {"index.md": _reference_index(modules)}
    for name in modules:
        pages |= module_pages(importlib.import_module(name))
    reference = folder / REFERENCE
    for old in reference.rglob("*.md"):
        if str(old.relative_to(reference)) not in pages:
            old.unlink()
    for path, text in pages.items():
        _write_if_new(reference / path, text)


def module_pages(module: Any) -> dict[str, str]:
    """Returns the pages of a module by file: one of its own, and one for each public name."""
    short = module.__name__.rpartition(".")[2]
    names = list(module.__all__)
    rows = [f"| [`{name}`]({short}/{name}.md) | {_summary(module, name)} |" for name in names]
    index = [
        f"# {module.__name__}",
        "",
        _directive("automodule", module.__name__, {"no-members": ""}),
        "",
        "| name | what it is |",
        "|---|---|",
        *rows,
        "",
        "```{toctree}",
        ":hidden:",
        "",
        *(f"{short}/{name}" for name in names),
        "```",
        "",
    ]
    pages = {f"{short}.md": "\n".join(index)}
    for name in names:
        text = _described(f"{module.__name__}.{name}", getattr(module, name))
        pages[f"{short}/{name}.md"] = f"# {name}\n\n{text}\n"
    return pages


def _reference_index(modules: Sequence[str]) -> str:
    rows = [
        f"| [`{name}`]({name.rpartition('.')[2]}.md) | "
        f"{_first_sentence(importlib.import_module(name).__doc__)} |"
        for name in modules
    ]
    return "\n".join(
        [
            "# Reference",
            "",
            "These modules are public: a name in their `__all__` changes only with a deprecation. "
            "Everything else in the package may change at any time.",
            "",
            "| module | what it is for |",
            "|---|---|",
            *rows,
            "",
            "```{toctree}",
            ":hidden:",
            "",
            *(name.rpartition(".")[2] for name in modules),
            "```",
            "",
        ]
    )


def _described(name: str, value: Any) -> str:
    if inspect.isclass(value):
        return _directive("autoclass", name, {})
    if callable(value):
        return _directive("autofunction", name, {})
    return _directive("py:data", name, {}).replace("\n```", f"\n\n   {_constant(value)}\n```")


def _directive(kind: str, name: str, options: dict[str, str]) -> str:
    lines = [f"   :{option}: {value}".rstrip() for option, value in options.items()]
    return "\n".join(["```{eval-rst}", f".. {kind}:: {name}", *lines, "```"])


def _summary(module: Any, name: str) -> str:
    value = getattr(module, name)
    if inspect.isclass(value) or callable(value):
        return _first_sentence(inspect.getdoc(value))
    return _constant(value)


def _constant(value: Any) -> str:
    """Returns what a constant is: the names in it, or its value."""
    if isinstance(value, Mapping | tuple | list):
        return f"A constant with {', '.join(f'`{item}`' for item in value)}."
    return f"The constant `{value!r}`."


def _first_sentence(doc: str | None) -> str:
    return " ".join((doc or "").split("\n\n")[0].split()).replace("|", "\\|")


def _write_if_new(path: Path, text: str) -> None:
    """Writes a page unless it is there as it is, so that Sphinx does not read it again."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
