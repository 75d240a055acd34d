"""Runs on a Ray cluster: each is counted once, also when a node is lost in the middle."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from drake_dress.cluster import completed_on, sent_code
from drake_dress.errors import UserError
from drake_dress.interrupt import Interrupt

ray = pytest.importorskip("ray")


@dataclass(frozen=True)
class Sleeper:
    """A run that leaves a line in a file when it begins, and a file of its own."""

    diary: Path
    seconds: float

    def __call__(self, case: int, folder: Path) -> dict[str, Any]:
        """Returns what the run came to."""
        with self.diary.open("a") as file:
            file.write(f"{case}\n")
        time.sleep(self.seconds)
        (folder / f"run_{case}").mkdir()
        (folder / f"run_{case}" / "note.txt").write_text(str(case))
        return {"case": case, "square": case * case}


@pytest.fixture
def two_nodes() -> Iterator[Any]:
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    other = cluster.add_node(num_cpus=1)
    cluster.wait_for_nodes()
    yield cluster, other
    ray.shutdown()
    cluster.shutdown()


@pytest.mark.alone
def test_a_node_that_is_lost_costs_only_its_runs(two_nodes: Any, tmp_path: Path) -> None:
    cluster, other = two_nodes
    diary = tmp_path / "diary.txt"
    brought: dict[int, dict[str, bytes]] = {}
    done = []
    runs = completed_on(
        cluster.address,
        Sleeper(diary, 0.5),
        range(12),
        Interrupt(),
        lambda case, files: brought.__setitem__(case, dict(files)),
    )
    for case, result in runs:
        done.append(case)
        assert result == {"case": case, "square": case * case}
        if len(done) == 4:
            cluster.remove_node(other, allow_graceful=False)
    # all once
    assert sorted(done) == list(range(12))
    begun = [int(line) for line in diary.read_text().split()]
    assert set(begun) == set(range(12))
    # what the lost node was at was begun again, and nothing else
    assert 12 <= len(begun) <= 14
    assert brought == {c: {f"run_{c}/note.txt": str(c).encode()} for c in range(12)}


@pytest.mark.parametrize(
    ("address", "told"),
    [
        ("127.0.0.1:1", "no cluster at 127.0.0.1:1: Connection refused"),
        ("ray://127.0.0.1:1", "no cluster"),
        ("somewhere", "expected auto or HOST:PORT"),
        ("host:0", "expected auto or HOST:PORT"),
        ("auto", "no cluster at auto"),
    ],
)
def test_no_cluster_is_told_in_one_line(
    address: str, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RAY_ADDRESS", raising=False)
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(UserError, match=told):
        list(completed_on(address, Sleeper(Path("x"), 0.0), [1], Interrupt()))
    assert signal.getsignal(signal.SIGTERM) is before


def test_the_error_names_the_command_that_was_given() -> None:
    runs = completed_on("host:0", Sleeper(Path("x"), 0.0), [1], Interrupt(), command="dataset")
    with pytest.raises(UserError) as error:
        list(runs)
    assert error.value.source == "dataset"


def test_a_checkout_is_sent_and_an_installed_package_is_not(tmp_path: Path) -> None:
    package = tmp_path / "drake_dress"
    assert sent_code(package) == {}
    (tmp_path / "pyproject.toml").touch()
    assert sent_code(package)["working_dir"] == str(tmp_path)
    # this test runs in a checkout
    assert Path(sent_code()["working_dir"]) == Path(__file__).parents[1]
