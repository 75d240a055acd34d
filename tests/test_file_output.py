"""Unwritable output is reported before work begins, and the check leaves no files behind."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.file_output import (
    RUN_FILES,
    claimed,
    prove_directory,
    prove_file,
    remove_results,
    replacing,
    write_text,
)


def tree(folder: Path) -> set[Path]:
    return set(folder.rglob("*"))


UNUSABLE = {
    "below a file": "file/sub/deeper",
    "a file": "file",
    "a long name": "a" * 300,
    "a long name below": "new/" + "a" * 300,
    "empty": "",
    "a NUL": "a\0b",
    "where the kernel lets nobody": "/proc/x",
    "a link to nothing": "nowhere",
    "a loop of links": "loop/x",
    "a log that is a folder": "taken",
}


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    (tmp_path / "nowhere").symlink_to(tmp_path / "gone" / "away")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "taken" / "run.h5").mkdir(parents=True)
    return tmp_path


@pytest.mark.parametrize("name", UNUSABLE)
def test_an_unusable_directory_is_told_with_its_option(name: str, place: Path) -> None:
    before = tree(place)
    with pytest.raises(UserError, match=r"^--out: ") as caught:
        prove_directory("--out", UNUSABLE[name], RUN_FILES)
    assert "\n" not in str(caught.value)
    assert tree(place) == before


def test_why_is_told(place: Path) -> None:
    for out, words in (
        ("file/sub/deeper", "file is a file"),
        ("nowhere", "leads nowhere"),
        ("a" * 300, "name too long"),
    ):
        with pytest.raises(UserError, match=words):
            prove_directory("--out", out, RUN_FILES)


@pytest.mark.parametrize("file", ["file/a.json", "taken", "a" * 300, "", "/proc/x.json", "loop"])
def test_an_unusable_file_is_told_with_its_option(file: str, place: Path) -> None:
    before = tree(place)
    with pytest.raises(UserError, match=r"^--json: "):
        prove_file("--json", file)
    assert tree(place) == before


@settings(max_examples=40)
@given(
    names=st.lists(st.text("abc.", min_size=1, max_size=5), min_size=1, max_size=4),
    there=st.integers(0, 4),
)
def test_to_prove_a_directory_leaves_all_as_it_was(
    names: list[str], there: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    base = tmp_path_factory.mktemp("base")
    Path(base, *[n for n in names[:there] if n.strip(".")]).mkdir(parents=True, exist_ok=True)
    before = tree(base)
    out = Path(base, *[n for n in names if n.strip(".")])
    assert prove_directory("--out", out, RUN_FILES) == out
    assert tree(base) == before


def test_what_is_there_stays_as_it_is(tmp_path: Path) -> None:
    write_text(tmp_path / "run.h5", "kept")
    prove_directory("--out", tmp_path, RUN_FILES)
    prove_file("--out", tmp_path / "run.h5")
    assert (tmp_path / "run.h5").read_text() == "kept"
    prove_file("--out", "/dev/null")
    write_text(Path("/dev/null"), "dropped")
    assert not Path("/dev/null").is_file()


def test_an_input_is_not_written_over(tmp_path: Path) -> None:
    scenario = tmp_path / "extended.yaml"
    scenario.write_text("seed: 1")
    with pytest.raises(UserError, match="is read, too"):
        prove_directory("--out", tmp_path, ["extended.yaml"], [scenario])


def test_names_as_long_as_can_be_are_written(tmp_path: Path) -> None:
    path = prove_file("--json", tmp_path / "new" / ("a" * 255))
    write_text(path, "text")
    assert path.read_text() == "text"


def test_a_failed_write_leaves_the_former_file(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    write_text(path, "before")
    with pytest.raises(RuntimeError), replacing(path) as partial:
        partial.write_text("half")
        raise RuntimeError
    assert path.read_text() == "before"
    assert tree(tmp_path) == {path}


def test_a_link_is_written_through(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "target")
    write_text(tmp_path / "target", "before")
    write_text(tmp_path / "link", "after")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_text() == "after"


def test_one_command_at_a_time_writes_to_a_directory(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with claimed("--out", out):
        with (
            pytest.raises(UserError, match="another drake-dress writes there"),
            claimed("--out", out),
        ):
            pytest.fail("both write there")
        (out / "a").touch()
    order: list[str] = []
    with claimed("--out", out):

        def second() -> None:
            with claimed("--out", out, wait=True):
                order.append("second")

        waiting = threading.Thread(target=second)
        waiting.start()
        waiting.join(0.1)
        order.append("first")
    waiting.join()
    assert order == ["first", "second"]


def test_a_directory_to_which_nothing_was_written_is_gone(tmp_path: Path) -> None:
    with claimed("--out", tmp_path / "new"):
        assert (tmp_path / "new").is_dir()
    with claimed("--out", tmp_path):
        pass
    assert tmp_path.is_dir()
    assert not tree(tmp_path)


def test_only_results_are_removed(tmp_path: Path) -> None:
    for name in (*RUN_FILES, "notes.txt", "explanation.json"):
        (tmp_path / name).touch()
    remove_results(tmp_path, RUN_FILES)
    assert set(os.listdir(tmp_path)) == {"notes.txt", "explanation.json"}


def test_folders_side_by_side_are_proved_at_once(tmp_path: Path) -> None:
    """Each command makes the common parent, and removes it again while others use it."""
    wrong: list[UserError] = []

    def prove(name: str) -> None:
        for _ in range(200):
            try:
                prove_directory("--out", tmp_path / "runs" / "today" / name, RUN_FILES)
            except UserError as error:
                wrong.append(error)

    threads = [threading.Thread(target=prove, args=(name,)) for name in "abc"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
    assert not any(name.is_file() for name in tree(tmp_path))
