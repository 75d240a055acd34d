"""Loads plugins: user code that extends the package, such as new effects.

A plugin is a Python file or module that calls, for example, `register_effect`. The command line
loads it with `--plugin`; an installed package names it in the entry-point group
`drake_dress.plugins`; the environment variable `DRAKE_DRESS_PLUGINS` holds a list. Child processes
inherit that variable, and a file's folder on `sys.path`, so that they import the same modules.
"""

from __future__ import annotations

import importlib
import os
import sys
import traceback
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from drake_dress.errors import UserError

GROUP = "drake_dress.plugins"
VARIABLE = "DRAKE_DRESS_PLUGINS"


def load_plugin(given: str) -> ModuleType:
    """Imports a plugin; returns its module.

    Args:
        given: A Python file, or the dotted name of an importable module.

    Raises:
        UserError: The plugin cannot be imported, or registers something incorrectly.
    """
    if given.endswith(".py") or os.sep in given:
        return _load_file(Path(given))
    return _imported(given, given)


def load_for_children(given: str) -> None:
    """Imports a plugin here and in the processes that this one starts.

    Raises:
        UserError: see `load_plugin`.
    """
    load_plugin(given)
    own = os.path.abspath(given) if given.endswith(".py") or os.sep in given else given
    listed = [p for p in os.environ.get(VARIABLE, "").split(os.pathsep) if p]
    if own not in listed:
        os.environ[VARIABLE] = os.pathsep.join([*listed, own])


def load_installed_plugins() -> None:
    """Imports the plugins of installed packages and of the environment variable, each once.

    Raises:
        UserError: A plugin cannot be imported. It is not skipped, since its additions would be
            missing silently.
    """
    for given in os.environ.get(VARIABLE, "").split(os.pathsep):
        if given:
            _load_once(given)
    _load_entry_points()


@cache
def _load_once(given: str) -> None:
    load_plugin(given)


@cache
def _load_entry_points() -> None:
    for entry in entry_points(group=GROUP):
        package = entry.dist.name if entry.dist else entry.name
        _imported(f"package {package}", entry.module)


def _load_file(path: Path) -> ModuleType:
    """Imports a file as a module; appends its folder to `sys.path`."""
    source = str(path)
    if not path.is_file():
        raise UserError("--plugin", source, "no such file, expected a Python file or a module")
    folder = str(path.resolve().parent)
    if folder not in sys.path:
        sys.path.append(folder)
    module = _imported(source, path.stem)
    if module.__file__ is None or not os.path.samefile(module.__file__, path):
        raise UserError(
            "--plugin", source, f"has the name of another module, {path.stem}; expected another"
        )
    return module


def _imported(source: str, module: str) -> ModuleType:
    importlib.invalidate_caches()
    try:
        return importlib.import_module(module)
    except UserError as error:
        where = ": ".join(part for part in (error.source, error.key) if part)
        raise UserError(source, where, error.message) from error
    except Exception as error:
        absent = error.name if isinstance(error, ModuleNotFoundError) else None
        if absent is not None and source == module and f"{module}.".startswith(f"{absent}."):
            raise UserError(
                "--plugin", source, "no such module, expected a Python file or a module"
            ) from error
        message = f"cannot be imported: {type(error).__name__}: {error}"
        raise UserError(source, _line(module, error), message) from error


def _line(module: str, error: BaseException) -> str:
    """Returns the failing line of the plugin's file, such as "line 3"; may be empty."""
    if isinstance(error, SyntaxError):
        return f"line {error.lineno}"
    stem = module.split(".")[-1]
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if Path(frame.filename).stem == stem
    ]
    return f"line {lines[-1]}" if lines else ""
