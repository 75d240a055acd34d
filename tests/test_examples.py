"""The examples are short and do what they say."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "examples"
# Regular expression for the output of each file.
EXPECTED = {
    "add_cost": r"without .* are at 1\.19 m after 3 s\nwith .* are at 1\.[01]\d m after 3 s",
    "add_scenario_key": r"\{'light_touch': \{'weight': 0\.01, .*\} swift\nlargest force \d",
    "explain_own_effect": r"lacks is a chain in the hem \(mass 0\.(09|10)\d* ± .* kg\)\.\n$",
    "explain_recording": r"cameras that are displaced(.*\n)*markers off by 35, now [3-8] mm\n$",
    "fit_fabric": r"stretch stiffness 60\.000 N/m\n$",
    "gym_episode": r"armhole \d+ cm from the hand, reward \+0\.[1-9]\d+\n$",
    "load_coat": r"left_cuff: \d+ nodes, girth (29|30) cm\n(.*\n)+hem .*: 0\.\d+ m lower\n$",
    "own_controller": r"the left gripper rose by \d\.\d cm\n$",
    "replay_log": r"1\.0 s in my_replay\.html, \d\.\d MB\n$",
    "solve_own_problem": r"converged: True[^$]*largest force 2\.000 N[^$]*to the wall 0\.200 m",
    "swap_predictor": r"asked [1-9]\d* times in 2\.0 s\n$",
    "read_log": r"s_left +force_left.*\n(.*\n)+largest force on a gripper: [1-9]\.\d N\n$",
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
