"""What the docs tell users to type begins to work where they type it: in the project's root."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SAID = re.compile(r"python (-m benchmarks\.[\w.]+\w|benchmarks/\w+\.py)")
TEXTS = [
    ROOT / "README.md",
    *ROOT.glob("docs/**/*.md"),
    *ROOT.glob("benchmarks/**/*.py"),
]
COMMANDS = sorted({c for text in TEXTS for c in SAID.findall(text.read_text(encoding="utf-8"))})


def test_there_are_some() -> None:
    assert len(COMMANDS) >= 5


@pytest.mark.parametrize("command", COMMANDS)
def test_the_command_tells_how_it_is_used(command: str) -> None:
    told = subprocess.run(
        [sys.executable, *command.split(), "--help"], cwd=ROOT, capture_output=True, text=True
    )
    assert told.returncode == 0, told.stderr
    assert "usage:" in told.stdout
