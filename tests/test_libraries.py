"""A missing library is reported by name, in one line."""

from __future__ import annotations

import builtins
import importlib
import re
from pathlib import Path
from typing import Any

import pytest

from drake_dress import libraries
from drake_dress.__main__ import main
from drake_dress.libraries import SYSTEM_LIBRARIES, import_problem

ROOT = Path(__file__).parents[1]
ERRORS = {
    "system library": (
        ImportError("libEGL.so.1: cannot open shared object file: No such file or directory"),
        "pydrake.geometry: cannot be loaded: libEGL.so.1 is missing, "
        "expected apt-get install libegl1",
    ),
    "unknown system library": (
        OSError("libfoo.so.3: cannot open shared object file: No such file or directory"),
        "pydrake.geometry: cannot be loaded: libfoo.so.3 is missing, "
        "expected the system package that has it",
    ),
    "module of an extra": (
        ModuleNotFoundError("No module named 'cv2'", name="cv2"),
        "cv2: is not installed, which pydrake uses, expected pip install 'drake_dress[vision]'",
    ),
    "module": (
        ModuleNotFoundError("No module named 'rtree'", name="rtree"),
        "rtree: is not installed, which pydrake uses",
    ),
    "versions": (
        ImportError("numpy.core.multiarray failed to import"),
        "pydrake.geometry: cannot be imported: numpy.core.multiarray failed to import",
    ),
    "binary": (
        ValueError("numpy.dtype size changed,\nmay indicate binary incompatibility"),
        "pydrake.geometry: cannot be imported: numpy.dtype size changed, may indicate",
    ),
}


@pytest.mark.parametrize("name", ERRORS)
def test_what_is_wrong_with_an_import_is_told(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libraries, "_loads", lambda _: True)
    error, words = ERRORS[name]
    assert str(import_problem(error, "pydrake.geometry")).startswith(words)


def test_all_missing_system_libraries_are_told_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libraries, "_loads", lambda name: name == "libX11.so.6")
    line = str(import_problem(ERRORS["system library"][0], "pydrake"))
    assert "apt-get install libegl1 libglx0 libopengl0" in line


@pytest.mark.parametrize("module", ["rtree", "pydrake.common", "h5py"])
def test_a_module_that_is_missing_when_a_command_begins(
    module: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    usual = importlib.import_module

    def missing(name: str, package: str | None = None) -> object:
        if name == module:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return usual(name, package)

    monkeypatch.setattr(importlib, "import_module", missing)
    assert main(["run", "scenario.yaml"]) == 2
    line = capsys.readouterr().err
    assert line.startswith(f"drake-dress: {module}: is not installed")
    assert line.count("\n") == 1


def test_a_module_that_is_missing_later(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    usual = builtins.__import__

    def missing(name: str, *words: Any, **more: Any) -> object:
        if name.startswith("drake_dress.diagrams.calibration"):
            raise ImportError("libGL.so.1: cannot open shared object file", name="cv2")
        return usual(name, *words, **more)

    monkeypatch.setattr(builtins, "__import__", missing)
    assert main(["calibrate", "folder"]) == 2
    line = capsys.readouterr().err
    assert "libGL.so.1" in line
    assert line.count("\n") == 1


def test_check_readme_and_installation_name_the_same_libraries() -> None:
    installed = dict(re.findall(r"(lib\S+\.so\.\d+):(\S+?)[; ]", (ROOT / ".ci/run").read_text()))
    assert installed == SYSTEM_LIBRARIES
    readme = (ROOT / "README.md").read_text()
    for name, package in SYSTEM_LIBRARIES.items():
        assert f"`{package}`" in readme, name
