"""What the study of mutants counts; Cosmic Ray itself is not needed here."""

from pathlib import Path

import pytest

from benchmarks.mutation.__main__ import _ROOT, main
from benchmarks.mutation.modules import MODULES, Module
from benchmarks.mutation.mutants import _meaning
from benchmarks.mutation.trial import CAUGHT, SURVIVED, TIMED_OUT, tried
from drake_dress.errors import UserError

_TEST = "from part import double\n\n\ndef test_it():\n    assert double(2) == 4\n"


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("return 2 * x", SURVIVED),
        ("return x**2", SURVIVED),
        ("return 2 + x + 1", CAUGHT),
        ("return y", CAUGHT),
        ("import os; os.abort()", CAUGHT),
        ("return 2 *", CAUGHT),
        ("while True: pass", TIMED_OUT),
    ],
)
def test_a_mutant_is_caught_where_tests_do_not_pass(
    body: str, expected: str, tmp_path: Path
) -> None:
    (tmp_path / "part.py").write_text(f"def double(x):\n    {body}\n")
    (tmp_path / "test_part.py").write_text(_TEST)
    timeout = 5.0 if expected == TIMED_OUT else 60.0
    said, spent = tried(Module(("part.py",), ("test_part.py",), timeout), tmp_path)
    assert said == expected
    assert spent < timeout + 30.0


def test_tests_that_are_not_there_are_no_catch(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="pytest ended with 4"):
        tried(Module(("part.py",), ("test_part.py",), 60.0), tmp_path)


def test_annotations_and_docstrings_mean_nothing() -> None:
    bare = "def f(x):\n    y = x\n    return y\n"
    told = 'def f(x: "int | None") -> int:\n    """Says."""\n    y = x\n    return y\n'
    other = 'def f(x: "int & None") -> str:\n    """Does not."""\n    y = x\n    return y\n'
    assert _meaning(told) == _meaning(other)
    assert _meaning(bare) != _meaning(bare.replace("y = x", "y = -x"))


def test_what_is_mutated_and_what_covers_it_are_there() -> None:
    for module in MODULES.values():
        for name in (*module.files, *module.tests):
            assert (_ROOT / name).exists(), name


def test_without_cosmic_ray_it_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "cosmic_ray.ast", None)
    with pytest.raises(UserError, match="needs Cosmic Ray"):
        main(["--mutants", "1", "--modules", "linking", "--json", str(tmp_path / "m.json")])
