"""Caches go to writable folders, and the program works without any."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from drake_dress.caches import prepare_caches, temporary_cache, usable

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    temporary_cache.cache_clear()
    yield tmp_path
    temporary_cache.cache_clear()


def read_only(path: Path) -> str:
    """Returns a folder that cannot be created: even root cannot make one below a file."""
    path.write_text("")
    return str(path / "home")


def test_where_the_usual_folders_are_of_use_nothing_changes(place: Path) -> None:
    usual = {"XDG_CACHE_HOME": str(place / "c"), "XDG_CONFIG_HOME": str(place / "s")}
    environment = dict(usual)
    prepare_caches(environment)
    assert environment == usual


def test_where_they_are_not_all_caches_go_below_the_temporary_folder(place: Path) -> None:
    bad = read_only(place / "file")
    names = ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "NUMBA_CACHE_DIR", "WARP_CACHE_PATH")
    environment = dict.fromkeys(names, bad)
    prepare_caches(environment)
    folder = place / "tmp" / f"drake-dress-{os.getuid()}"
    assert environment["XDG_CACHE_HOME"] == str(folder)
    assert Path(environment["MPLCONFIGDIR"]).is_relative_to(folder)
    assert "NUMBA_CACHE_DIR" not in environment
    assert "WARP_CACHE_PATH" not in environment
    assert folder.stat().st_mode & 0o077 == 0


def test_a_user_without_a_home_has_caches_too(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def nobody() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", nobody)
    environment: dict[str, str] = {}
    prepare_caches(environment)
    assert Path(environment["XDG_CACHE_HOME"]).is_relative_to(place / "tmp")


@pytest.mark.parametrize("taken", ["open to others", "a link", "a file"])
def test_a_folder_that_others_can_write_to_is_not_used(place: Path, taken: str) -> None:
    folder = place / "tmp" / f"drake-dress-{os.getuid()}"
    if taken == "open to others":
        folder.mkdir(mode=0o777)
        folder.chmod(0o777)
    elif taken == "a link":
        (place / "other").mkdir(mode=0o700)
        folder.symlink_to(place / "other")
    else:
        folder.write_text("")
    assert temporary_cache() is None


def test_a_folder_of_another_user_is_not_used(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    assert temporary_cache() is None


def test_the_working_directory_is_no_cache(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place / "tmp")
    assert temporary_cache() is None
    assert not any((place / "tmp").iterdir())


def test_a_full_disk_is_of_no_use(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert usable(place / "a")
    if os.path.exists("/dev/full"):
        monkeypatch.setattr(tempfile, "TemporaryFile", lambda dir: open("/dev/full", "wb"))  # noqa: SIM115
    assert not usable(place / "a")


KERNEL = """
import numba, sys
from drake_dress import kernel_cache
kernel_cache.install()
import kernel_of_a_test
assert kernel_of_a_test.twice(3) == 6
print(type(kernel_of_a_test.twice._cache).__name__, kernel_of_a_test.twice.stats.cache_path)
"""


def kernel_run(place: Path, **environment: str) -> str:
    """Compiles a kernel whose module cannot have a cache beside it; returns the cache's kind."""
    source = place / "source"
    if not source.exists():
        source.mkdir()
        (source / "__pycache__").write_text("")  # a file, so that no such folder can exist
        (source / "kernel_of_a_test.py").write_text(
            "import numba\n@numba.njit(cache=True)\ndef twice(x):\n    return 2 * x\n"
        )
    done = subprocess.run(
        [sys.executable, "-c", KERNEL],
        env=os.environ | {"PYTHONPATH": f"{ROOT}:{source}"} | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_kernels_are_kept_below_the_temporary_folder_or_in_memory(place: Path) -> None:
    bad = read_only(place / "file")
    nowhere = {"XDG_CACHE_HOME": bad, "XDG_CONFIG_HOME": bad, "HOME": bad}
    told = kernel_run(place, TMPDIR=str(place / "tmp"), **nowhere)
    assert str(place / "tmp") in told
    kept = list((place / "tmp").rglob("*.nb?"))
    assert len(kept) == 2
    # A damaged cache is replaced: kernels are compiled again.
    for path in kept:
        path.write_bytes(b"damaged")
    kernel_run(place, TMPDIR=str(place / "tmp"), **nowhere)
    assert all(path.read_bytes() != b"damaged" for path in kept)
    (place / "tmp" / f"drake-dress-{os.getuid()}").chmod(0o777)
    assert "NullCache" in kernel_run(place, TMPDIR=str(place / "tmp"), **nowhere)


def test_a_disk_that_fills_up_only_costs_the_cache() -> None:
    from numba import njit
    from numba.core import caching

    from drake_dress import kernel_cache

    kernel_cache.install()

    @njit(cache=True)
    def thrice(x: int) -> int:
        return 3 * x

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(caching.IndexDataCacheFile, "_save_index", full)
        assert thrice(3) == 9


def test_compiling_is_told_once_it_takes_long() -> None:
    from drake_dress.kernel_cache import Telling

    out, now = io.StringIO(), [0.0]
    telling = Telling(out, lambda: now[0])
    for at in (0.0, 1.0, 2.5, 3.0, 17.4, 17.6):
        telling.begin()
        now[0] = at
        telling.end()
    lines = out.getvalue().splitlines()
    assert [line.split(": ")[1] for line in lines] == ["3 so far", "6 so far"]
    assert all("once on this machine" in line for line in lines)
