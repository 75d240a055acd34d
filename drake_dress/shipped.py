"""Finds the scenarios that ship with the program."""

from __future__ import annotations

import difflib
import os
import re
from pathlib import Path

from drake_dress.errors import UserError

_PACKAGE = Path(__file__).parent
# In a checkout, the folder in the package is a symbolic link, which some systems do not keep.
_FOLDERS = (_PACKAGE / "scenarios", _PACKAGE.parent / "scenarios")


def shipped_scenario(name: str) -> Path:
    """Returns the file of a shipped scenario, such as "lab"."""
    files = [folder / f"{name}.yaml" for folder in _FOLDERS]
    return next((file for file in files if file.is_file()), files[0])


def shipped_scenarios() -> dict[str, str]:
    """Returns the names of all shipped scenarios and the first sentence of each comment."""
    return {file.stem: _summary(file) for file in _files()}


def scenario_file(given: str) -> Path:
    """Returns the file for a path or the name of a shipped scenario.

    A file of that name in the working directory takes precedence over a shipped scenario. A
    directory, such as one that an earlier command wrote with `--out`, does not.

    Raises:
        UserError: There is neither a file nor a shipped scenario of that name.
    """
    path = Path(given)
    here = os.path.exists(path) and not os.path.isdir(path)
    if here or path.suffix or path.name != given:
        return path
    names = [file.stem for file in _files()]
    if given in names:
        return shipped_scenario(given)
    near = difflib.get_close_matches(given, names, n=1)
    expected = f"did you mean {near[0]}?" if near else f"expected a file or {', '.join(names)}"
    raise UserError(given, "", f"no file and no scenario that ships, {expected}")


def _files() -> list[Path]:
    folder = next((f for f in _FOLDERS if f.is_dir()), _FOLDERS[0])
    return sorted(folder.glob("*.yaml"))


def _summary(file: Path) -> str:
    comment = []
    for line in file.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        comment.append(line.lstrip("# "))
    return re.split(r"(?<=[.:]) ", " ".join(comment) + " ")[0].rstrip(" .:") + "."
