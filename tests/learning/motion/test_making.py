"""Sequences are the same however many processes make them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

from drake_dress.interrupt import Interrupt
from drake_dress.learning.motion import making
from drake_dress.learning.motion.making import Block, Workplace, made, make_block
from drake_dress.learning.motion.motion_file import MotionArrays

BLOCKS = [Block("free", 1, 0, 6), Block("free", 1, 6, 2)]


def test_a_block_is_split_without_gaps() -> None:
    parts = Block("free", 1, 50, 5).split()
    assert [(p.first, p.count) for p in parts] == [(50, 2), (52, 2), (54, 1)]


def test_the_number_of_processes_does_not_change_the_sequences() -> None:
    one, two = (dict(made(BLOCKS, Workplace(jobs), Interrupt())) for jobs in (1, 2))
    assert set(one) == set(two) == set(BLOCKS)
    for block, arrays in one.items():
        assert len(arrays) == block.count
        for name, array in arrays.arrays().items():
            assert array.tobytes() == two[block].arrays()[name].tobytes()
    # a sequence does not depend on what is made beside it
    alone = make_block(Block("free", 1, 3, 1))
    np.testing.assert_array_equal(one[BLOCKS[0]].joint_position[3], alone.joint_position[0])


def test_sequences_are_counted_as_they_are_made() -> None:
    counted: list[int] = []
    list(made(BLOCKS, Workplace(1), Interrupt(), counted.append))
    assert sorted(counted) == [2, 2, 2, 2]


def test_a_cluster_makes_the_same_sequences(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def cluster(
        address: str,
        run: Callable[[Block, Path], MotionArrays],
        cases: Sequence[Block],
        stop: Interrupt,
        command: str,
    ) -> Iterator[tuple[Block, MotionArrays]]:
        asked.append(f"{command} {address}")
        # nodes are done in any order
        for case in reversed(cases):
            yield case, run(case, Path())

    monkeypatch.setattr(making, "completed_on", cluster)
    there = dict(made(BLOCKS, Workplace(1, "auto"), Interrupt()))
    assert asked == ["dataset auto"]
    for block, arrays in made(BLOCKS, Workplace(1), Interrupt()):
        np.testing.assert_array_equal(there[block].joint_position, arrays.joint_position)


def test_after_a_signal_no_more_work_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    stop, begun = Interrupt(), []

    def made_once(block: Block) -> object:
        begun.append(block)
        stop.set()
        return make_block(block)

    monkeypatch.setattr(making, "make_block", made_once)
    assert not list(made(BLOCKS, Workplace(1), stop))
    assert len(begun) <= 2


def test_a_signal_ends_the_processes_at_once() -> None:
    stop = Interrupt()
    started = time.monotonic()
    threading.Timer(2.0, stop.set).start()
    # a minute of work
    assert not list(made([Block("passive", 1, 0, 300)], Workplace(2), stop))
    assert time.monotonic() - started < 30.0


def test_nothing_is_made_of_nothing() -> None:
    assert not list(made([], Workplace(4), Interrupt()))
