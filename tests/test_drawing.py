"""Pictures are drawn into files, whatever the user's Matplotlib settings."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DRAW = """
import os, sys
from drake_dress.report.page import chart, embedded
from drake_dress.report import report_html
from drake_dress.discrepancy import report
assert "matplotlib" not in sys.modules
from drake_dress.drawing import plain_settings
from drake_dress.report.scene import _text_mesh
with plain_settings():
    figure, (ax,) = chart(4.0, 2.0)
    ax.plot([0, 1], [1, 0], label="line")
    print(hash(embedded(figure, "title")))
assert len(report_html._png(__import__("numpy").zeros((4, 4, 3), "uint8"))) > 50
assert _text_mesh("left", 0.1)[0].shape[1] > 10
assert "matplotlib.pyplot" not in sys.modules
print(os.environ.get("MPLBACKEND"))
"""


@pytest.fixture(scope="module")
def drawn() -> str:
    return draw({})


def draw(settings: dict[str, str], cwd: Path = ROOT) -> str:
    environment = {k: v for k, v in os.environ.items() if k != "MPLBACKEND"}
    environment |= {"PYTHONPATH": str(ROOT), "PYTHONHASHSEED": "1"} | settings
    done = subprocess.run(
        [sys.executable, "-c", DRAW], env=environment, cwd=cwd, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.split()[0]


@pytest.mark.parametrize("backend", ["module://no_such.backend", "TkAgg", "nonsense"])
def test_any_backend_will_do(backend: str, drawn: str) -> None:
    assert draw({"MPLBACKEND": backend}) == drawn


def test_settings_of_the_user_change_nothing(drawn: str, tmp_path: Path) -> None:
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\nlines.linewidth: 9\n")
    assert draw({}, tmp_path) == drawn
