import json
from pathlib import Path

import pytest

from benchmarks.gym.__main__ import main

QUICK = ["plant.spacing=0.05", "plant.self_collision=false", "duration=0.2"]
SET = [word for setting in QUICK for word in ("--set", setting)]


def test_a_dressing_that_did_not_succeed_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "gym.json"
    status = main(["--only", "dressing", "--seeds", "0,1", *SET, "--json", str(file)])
    assert status == 1
    assert "dummy_standing, seed 1: time" in capsys.readouterr().out
    content = json.loads(file.read_text())
    (figure,) = content["figures"]
    assert (figure["value"], figure["asked"], figure["met"]) == (0, 2, False)
    (rows,) = content["tables"].values()
    assert [row["seed"] for row in rows] == [0, 1]
    assert rows[0]["return"] == pytest.approx(rows[0]["approach"] + rows[0]["gripper_force"])


def test_what_cannot_be_used_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--seeds", "one"])
    assert "'one', expected numbers with commas between" in capsys.readouterr().err
