"""The study of ended runs tells what was lost, and what of two runs is mixed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.killed.ended_run import Ended
from benchmarks.killed.verdict import FILES, fingerprints, problems
from tests.report.synthetic import coat, dressing, write

GARMENT = coat(0.06)
SOUND = Ended(status=-9, words="", wall=10.0, acted=9.0, told=(0.0, 0.0))


def run_of(folder: Path, seed: int) -> Path:
    """Returns a folder with the files of a whole run."""
    folder.mkdir(exist_ok=True)
    write(folder / "run.h5", GARMENT, dressing(GARMENT), seed)
    (folder / "summary.json").write_text(json.dumps({"seed": seed}))
    for name in ("report.html", "replay.html"):
        (folder / name).write_text(f"seed {seed}")
    return folder


def test_files_of_one_run_alone_are_as_they_have_to_be(tmp_path: Path) -> None:
    earlier = fingerprints(run_of(tmp_path / "earlier", 1))
    assert set(earlier) == set(FILES)
    for seed in (1, 2):
        # killed before it touched anything, or after it wrote all
        assert problems(run_of(tmp_path / f"out{seed}", seed), earlier, 2, "kill", SOUND) == []


@pytest.mark.parametrize("left", ["summary.json", "report.html", "replay.html"])
def test_a_file_of_the_earlier_run_beside_the_new_log_is_a_mixture(
    tmp_path: Path, left: str
) -> None:
    earlier = run_of(tmp_path / "earlier", 1)
    out = run_of(tmp_path / "out", 2)
    (out / left).write_bytes((earlier / left).read_bytes())
    assert any("mixture" in p for p in problems(out, fingerprints(earlier), 2, "kill", SOUND))


def test_what_was_told_has_to_be_in_the_log(tmp_path: Path) -> None:
    out = run_of(tmp_path / "out", 2)
    late = Ended(status=-9, words="", wall=10.0, acted=9.0, told=(500.0, 2.0))
    assert any("was told" in p for p in problems(out, {}, 2, "kill", late))
    just = Ended(status=-9, words="", wall=10.0, acted=9.0, told=(500.0, 8.5))
    assert problems(out, {}, 2, "kill", just) == []


def test_a_lost_log_a_traceback_and_a_wrong_status_are_told(tmp_path: Path) -> None:
    out = run_of(tmp_path / "out", 2)
    told = Ended(status=-15, words="Traceback (most recent", wall=9.0, acted=8.0, told=(1.0, 5.0))
    (out / "run.h5").unlink()
    found = problems(out, {}, 2, "terminate", told)
    assert len(found) == 3
    (out / "run.h5").write_bytes(b"no log")
    assert any("cannot be read" in p for p in problems(out, {}, 2, "terminate", told))


def test_a_run_that_does_not_end_at_a_signal_is_told(tmp_path: Path) -> None:
    out = run_of(tmp_path / "out", 2)
    hangs = Ended(status=143, words="", wall=300.0, acted=9.0, told=(0.0, 0.0))
    assert any("291 s after" in p for p in problems(out, {}, 2, "group", hangs))
    ends = Ended(status=143, words="", wall=11.0, acted=9.0, told=(0.0, 0.0))
    assert problems(out, {}, 2, "group", ends) == []
