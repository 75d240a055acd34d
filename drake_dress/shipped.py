"""Scenarios that ship with the program, wherever it is run from."""

from __future__ import annotations

from pathlib import Path


def shipped_scenario(name: str) -> Path:
    """Returns the file of a scenario, such as "lab"."""
    package = Path(__file__).parent
    # In a checkout, the folder in the package is a link, which not every system keeps.
    folders = (package / "scenarios", package.parent / "scenarios")
    files = [folder / f"{name}.yaml" for folder in folders]
    return next((file for file in files if file.is_file()), files[0])
