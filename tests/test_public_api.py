"""Names of `drake_dress.cloth`, `.control` and the other public modules."""

import importlib
import subprocess
import sys

import pytest

MODULES = ("cloth", "control", "dressing", "explain", "gym")
# Modules that need neither Drake nor torch.
PLAIN = ("cloth", "control")


@pytest.mark.parametrize("name", MODULES)
def test_all_names_are_there_and_described(name: str) -> None:
    module = importlib.import_module(f"drake_dress.{name}")
    assert module.__doc__
    for public in module.__all__:
        value = getattr(module, public)
        if callable(value):
            assert value.__doc__


@pytest.mark.parametrize("name", PLAIN)
def test_it_imports_neither_drake_nor_torch(name: str) -> None:
    code = f"import sys, drake_dress.{name}; print({{'pydrake', 'torch'}} & set(sys.modules))"
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "set()\n"
