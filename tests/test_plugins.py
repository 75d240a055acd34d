"""A user's own code is loaded by name, in this process and in those that it starts."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from drake_dress import plugins
from drake_dress.__main__ import UNUSABLE, main
from drake_dress.errors import UserError
from drake_dress.models.effects.registry import EFFECTS, own_effects, unregister_effect
from drake_dress.plugins import (
    VARIABLE,
    load_for_children,
    load_installed_plugins,
    load_plugin,
)

EFFECT = """
from dataclasses import dataclass

from drake_dress.explain import GravityEffect, parameter, register_effect


@register_effect
@dataclass(frozen=True)
class Moon(GravityEffect):
    NAME = "{name}"
    share: float = parameter("1", 0.0, 1.0, 0.5)

    def apply(self, gravity):
        return (1.0 - self.share) * gravity

    def derivative(self, name, gravity):
        return -gravity
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder for plugins; afterwards all traces of them are removed."""
    modules, path = set(sys.modules), list(sys.path)
    monkeypatch.setenv(VARIABLE, "")
    plugins._load_entry_points.cache_clear()
    plugins._load_once.cache_clear()
    yield tmp_path
    for name in own_effects():
        unregister_effect(name)
    for name in set(sys.modules) - modules:
        if name.startswith("plugin_"):
            del sys.modules[name]
    sys.path[:] = path


def written(folder: Path, stem: str, text: str = EFFECT) -> Path:
    file = folder / f"{stem}.py"
    file.write_text(text.replace("{name}", stem), encoding="utf-8")
    return file


def test_a_file_is_loaded_and_its_effects_are_known(folder: Path) -> None:
    module = load_plugin(str(written(folder, "plugin_file")))
    assert EFFECTS["plugin_file"] is module.Moon
    assert load_plugin(str(folder / "plugin_file.py")) is module


def test_a_module_is_loaded_by_its_dotted_name(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "plugin_package").mkdir()
    written(folder / "plugin_package", "moon", EFFECT.replace("{name}", "plugin_module"))
    monkeypatch.syspath_prepend(str(folder))
    load_plugin("plugin_package.moon")
    assert own_effects() == ("plugin_module",)


@pytest.mark.parametrize(
    ("stem", "text", "words"),
    [
        ("plugin_absent", None, ["--plugin", "plugin_absent.py", "no such file"]),
        ("plugin_syntax", "a = 1\nb = = 2\n", ["plugin_syntax.py", "line 2", "SyntaxError"]),
        ("plugin_raises", "\n\n1 / 0\n", ["plugin_raises.py", "line 3", "ZeroDivisionError"]),
        ("plugin_needs", "import no_such_module\n", ["line 1", "No module named 'no_such_module'"]),
        ("plugin_unit", EFFECT.replace('"1"', '""'), ["effect Moon: share", "has no unit"]),
        ("json", EFFECT, ["json.py", "name of another module, json"]),
    ],
)
def test_what_cannot_be_loaded_is_told_in_one_line(
    folder: Path, stem: str, text: str | None, words: list[str]
) -> None:
    file = folder / f"{stem}.py"
    if text is not None:
        written(folder, stem, text)
    with pytest.raises(UserError) as error:
        load_plugin(str(file))
    for word in words:
        assert word in str(error.value)
    assert "\n" not in str(error.value)
    assert own_effects() == ()


def test_a_module_that_is_not_there_is_told() -> None:
    with pytest.raises(UserError, match=r"--plugin: no_such\.module: no such module"):
        load_plugin("no_such.module")


def test_other_processes_load_it_too(folder: Path) -> None:
    file = written(folder, "plugin_child")
    load_for_children(str(file))
    load_for_children(str(file))
    assert os.environ[VARIABLE] == str(file)
    code = (
        "from drake_dress.plugins import load_installed_plugins\n"
        "from drake_dress.models.effects.registry import own_effects\n"
        "load_installed_plugins()\n"
        "print(*own_effects())\n"
    )
    told = subprocess.check_output([sys.executable, "-c", code], text=True, env=os.environ)
    assert told == "plugin_child\n"


def test_the_plugins_of_installed_packages_are_loaded(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(folder, "plugin_installed")
    package = folder / "moonlab-1.0.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: moonlab\nVersion: 1.0\n")
    (package / "entry_points.txt").write_text(f"[{plugins.GROUP}]\nmoon = plugin_installed\n")
    monkeypatch.syspath_prepend(str(folder))
    importlib.invalidate_caches()
    load_installed_plugins()
    assert own_effects() == ("plugin_installed",)


def test_a_package_whose_plugin_fails_is_named(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = folder / "brokenlab-1.0.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: brokenlab\nVersion: 1.0\n")
    (package / "entry_points.txt").write_text(f"[{plugins.GROUP}]\nmoon = plugin_gone\n")
    monkeypatch.syspath_prepend(str(folder))
    importlib.invalidate_caches()
    with pytest.raises(UserError, match=r"package brokenlab: .*No module named 'plugin_gone'"):
        load_installed_plugins()


@pytest.mark.parametrize(
    "words",
    [
        ["run", "measured"],
        ["sim-station", "measured"],
        ["explain", "measured.h5", "--scenario", "measured"],
        ["dataset", "measured", "--hide", "nothing", "--out", "out"],
        ["bench", "explain"],
    ],
)
def test_each_command_that_knows_effects_takes_plugins(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*words, "--plugin", "no_such_plugin.py"]) == UNUSABLE
    errors = capsys.readouterr().err
    assert errors.startswith("drake-dress: --plugin: no_such_plugin.py: no such file")
    assert errors.count("\n") == 1
