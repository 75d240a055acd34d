"""A job uses only the cores that it is allowed to use."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from drake_dress import machine
from drake_dress.machine import limit_threads, worker_count


@pytest.fixture(autouse=True)
def eight_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)))


def group(folder: Path, **files: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name.replace("__", ".")).write_text(text)


def test_an_affinity_is_obeyed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert worker_count(tmp_path, tmp_path / "none") == 8
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {3})
    assert worker_count(tmp_path, tmp_path / "none") == 1


@pytest.mark.parametrize(
    ("text", "count"),
    [("max 100000", 8), ("150000 100000", 1), ("400000 100000", 4), ("10000 100000", 1), ("x", 8)],
)
def test_a_quota_of_any_group_above_is_obeyed(tmp_path: Path, text: str, count: int) -> None:
    own = tmp_path / "own"
    own.write_text("0::/job/step\n")
    group(tmp_path / "job" / "step", cpu__max="max 100000")
    group(tmp_path / "job", cpu__max=text + "\n")
    assert worker_count(tmp_path, own) == count


def test_threads_obey_a_quota_unless_the_user_has_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    environment = {"OMP_NUM_THREADS": "5"}
    monkeypatch.setattr(machine, "worker_count", lambda: 8)
    limit_threads(environment)
    assert environment == {"OMP_NUM_THREADS": "5"}
    monkeypatch.setattr(machine, "worker_count", lambda: 2)
    limit_threads(environment)
    assert environment["OMP_NUM_THREADS"] == "5"
    assert environment["OPENBLAS_NUM_THREADS"] == "2"


def test_a_quota_of_the_older_kind_is_obeyed(tmp_path: Path) -> None:
    own = tmp_path / "own"
    own.write_text("4:memory:/a\n3:cpu,cpuacct:/a\n")
    group(tmp_path / "cpu" / "a", cpu__cfs_quota_us="200000", cpu__cfs_period_us="100000")
    assert worker_count(tmp_path, own) == 2
    group(tmp_path / "cpu" / "a", cpu__cfs_quota_us="-1")
    assert worker_count(tmp_path, own) == 8
