"""The command makes what is missing, keeps what is there, and refuses what is of another set."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest

from drake_dress import __version__
from drake_dress.errors import UserError
from drake_dress.file_output import claimed
from drake_dress.interrupt import Interrupt
from drake_dress.learning.motion import commands, dressings, making
from drake_dress.learning.motion.commands import Wanted, write_motion_set
from drake_dress.learning.motion.dataset import CARD, INDEX, read_motion
from drake_dress.learning.motion.dressings import Dressing
from drake_dress.learning.motion.making import Workplace, made
from drake_dress.learning.motion.motion_file import MotionFile, Origin, write_motion
from drake_dress.learning.motion.sequence import COUNT, KINDS, Kind, Sequence
from tests.learning.motion.persons import made_up

HERE = Workplace(1)
COUNTS: dict[Kind, int] = {"passive": 2, "active": 1, "free": 53}
WANTED = Wanted(4, COUNTS)
NAMES = [
    CARD,
    "motion-active-00000.h5",
    "motion-free-00000.h5",
    "motion-free-00050.h5",
    "motion-passive-00000.h5",
    INDEX,
]


def quick_sequence(kind: Kind, seed: int, number: int) -> Sequence:
    """Returns random numbers in place of a sequence."""
    rng = np.random.default_rng((seed, KINDS.index(kind), number))
    flags = rng.integers(0, 2, (COUNT, 2))
    return Sequence(rng.normal(size=(COUNT, 6, 3)), rng.normal(size=(COUNT, 2, 6)), flags, flags)


@pytest.fixture(scope="module", autouse=True)
def _quick() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(making, "make_sequence", quick_sequence)
        yield


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sets") / "whole"
    assert write_motion_set(folder, WANTED, HERE) == 0
    return folder


def content(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted(folder.iterdir())}


def copied(whole: Path, folder: Path, *without: str) -> Path:
    for name, data in content(whole).items():
        if name not in without:
            (folder / name).write_bytes(data)
    return folder


def test_a_set_has_its_files_and_can_be_read(whole: Path) -> None:
    assert list(content(whole)) == NAMES
    assert len(read_motion(whole)) == 2 + 1 + 40
    assert f"--seed 4 {WANTED.sizes}" in (whole / CARD).read_text()


def test_a_resumed_run_gives_the_files_of_an_uninterrupted_one(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copied(whole, tmp_path, "motion-active-00000.h5", "motion-free-00050.h5", CARD, INDEX)
    kept = (tmp_path / "motion-free-00000.h5").stat().st_mtime_ns
    assert write_motion_set(tmp_path, WANTED, HERE) == 0
    assert content(tmp_path) == content(whole)
    assert (tmp_path / "motion-free-00000.h5").stat().st_mtime_ns == kept
    told = capsys.readouterr()
    assert "files: 2 kept, 2 missing" in told.out
    assert "motion-active-00000.h5: 1 of 4 sequences" in told.err


def test_a_damaged_file_is_named_and_made_again(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = copied(whole, tmp_path) / "motion-active-00000.h5"
    path.write_bytes(path.read_bytes()[:-50])
    assert write_motion_set(tmp_path, WANTED, HERE) == 0
    assert "motion-active-00000.h5: is cut short" in capsys.readouterr().err
    assert content(tmp_path) == content(whole)


def test_a_set_is_extended(whole: Path, tmp_path: Path) -> None:
    copied(whole, tmp_path)
    assert write_motion_set(tmp_path, Wanted(4, COUNTS | {"free": 55}), HERE) == 0
    assert len(read_motion(tmp_path, ["free"], "test")) == 8
    before = content(whole)["motion-free-00000.h5"]
    assert content(tmp_path)["motion-free-00000.h5"] == before


@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        (Wanted(5, COUNTS), "seed: is 4, expected 5; use another --out, or remove the file"),
        (Wanted(4, COUNTS | {"free": 52}), "motion-free-00050.h5: is of a larger set"),
        (Wanted(4, COUNTS | {"free": 20}), "motion-free-00000.h5: is of a larger set"),
        (Wanted(4, COUNTS | {"active": 0}), "motion-active-00000.h5: is of a larger set"),
    ],
)
def test_a_folder_of_another_set_is_left_alone(wanted: Wanted, told: str, whole: Path) -> None:
    before = content(whole)
    with pytest.raises(UserError, match=told):
        write_motion_set(whole, wanted, HERE)
    assert content(whole) == before


def test_a_file_of_another_version_or_program_is_refused(whole: Path, tmp_path: Path) -> None:
    copied(whole, tmp_path)
    path = tmp_path / "motion-passive-00000.h5"
    write_motion(path, MotionFile(Origin("passive", 4, 0, "0.0"), made_up(2, 201), {}))
    with pytest.raises(UserError, match=r"version: is 0\.0, expected"):
        write_motion_set(tmp_path, WANTED, HERE)
    with h5py.File(path, "a") as file:
        file.attrs["schema"] = "somebody.else/1"
    with pytest.raises(UserError, match=r"schema: is 'somebody\.else/1'"):
        write_motion_set(tmp_path, WANTED, HERE)


def test_sequences_of_another_length_are_refused(whole: Path, tmp_path: Path) -> None:
    path = copied(whole, tmp_path) / "motion-passive-00000.h5"
    origin = Origin("passive", 4, 0, __version__)
    write_motion(path, MotionFile(origin, made_up(2, COUNT - 1), {}))
    with pytest.raises(UserError, match=f"has {COUNT - 1} samples a sequence, expected {COUNT}"):
        write_motion_set(tmp_path, WANTED, HERE)


def test_what_is_done_before_a_signal_is_kept(
    whole: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    interrupts: list[Interrupt] = []

    def remembered(blocks: object, place: Workplace, stop: Interrupt, advance: object) -> object:
        interrupts.append(stop)
        return made(blocks, place, stop, advance)  # type: ignore[arg-type]

    def then_stopped(path: Path, file: MotionFile) -> None:
        write_motion(path, file)
        interrupts[0].set()

    monkeypatch.setattr(commands, "made", remembered)
    monkeypatch.setattr(commands, "write_motion", then_stopped)
    out = tmp_path / "new"
    assert write_motion_set(out, WANTED, HERE) == 130
    told = capsys.readouterr().out
    assert "interrupted" in told
    assert "the same command makes them" in told
    done = content(out)
    assert 0 < len(done) < 4
    assert CARD not in done
    monkeypatch.undo()
    assert write_motion_set(out, WANTED, HERE) == 0
    assert content(out) == content(whole)


def test_dressings_get_a_line_each_and_are_kept(
    whole: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    copied(whole, tmp_path)
    runs: list[Dressing] = []

    def run(dressing: Dressing, folder: Path, set_seed: int, stop: object = None) -> MotionFile:
        runs.append(dressing)
        origin = Origin("dressing", set_seed, dressing.number, __version__)
        notes = {"person": dressing.person, "dressed": True, "reason": ""}
        return MotionFile(origin, made_up(1, 101), notes)

    monkeypatch.setattr(dressings, "run_dressing", run)
    for wanted, lines in ((2, 2), (2, 0), (5, 3)):
        assert write_motion_set(tmp_path, Wanted(4, COUNTS, wanted), HERE) == 0
        told = capsys.readouterr().err.splitlines()
        assert len([line for line in told if "5 s, both sleeves on" in line]) == lines
    assert len(runs) == 5
    assert "5\nof 5 runs ended with both sleeves on" in (tmp_path / CARD).read_text()
    with pytest.raises(UserError, match="is of a larger set"):
        write_motion_set(tmp_path, Wanted(4, COUNTS, 4), HERE)


def test_two_commands_do_not_write_to_one_folder(tmp_path: Path) -> None:
    with claimed("--out", tmp_path):
        with pytest.raises(UserError, match="another drake-dress writes there"):
            write_motion_set(tmp_path, WANTED, HERE)
