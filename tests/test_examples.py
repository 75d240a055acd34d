"""The examples: short, and do what they say."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "examples"
# By file, what its output has to match.
EXPECTED = {
    "fit_fabric": r"stretch stiffness 60\.000 N/m\n$",
    "gym_episode": r"armhole \d+ cm from the hand, reward \+0\.[1-9]\d+\n$",
}


def test_all_are_known() -> None:
    assert sorted(EXPECTED) == sorted(file.stem for file in FOLDER.glob("*.py"))


@pytest.mark.parametrize("name", EXPECTED)
def test_an_example_runs_from_anywhere(name: str, tmp_path: Path) -> None:
    file = FOLDER / f"{name}.py"
    assert len(file.read_text(encoding="utf-8").splitlines()) <= 40
    done = subprocess.run([sys.executable, file], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert re.search(EXPECTED[name], done.stdout)
