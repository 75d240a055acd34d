"""What `drake_dress.cloth` makes public."""

import subprocess
import sys

from drake_dress import cloth


def test_all_names_are_there_and_described() -> None:
    for name in cloth.__all__:
        value = getattr(cloth, name)
        if callable(value):
            assert value.__doc__


def test_it_imports_neither_drake_nor_torch() -> None:
    code = "import sys, drake_dress.cloth; print({'pydrake', 'torch'} & set(sys.modules))"
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "set()\n"
