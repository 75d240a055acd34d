"""Makes sequences in parallel, on the cores of this machine or on a Ray cluster.

Each sequence has its own random generator, so the result depends neither on the number of processes
nor on their order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import wait
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from drake_dress.cluster import completed_on
from drake_dress.discrepancy.workers import answers
from drake_dress.interrupt import Interrupt
from drake_dress.learning.motion.motion_file import MotionArrays
from drake_dress.learning.motion.scenes import make_sequence
from drake_dress.learning.motion.sequence import Kind
from drake_dress.side_by_side import completed
from drake_dress.worker_pool import WorkerPool

COMMAND = "dataset"  # for messages on `--ray`
_TOGETHER = 2  # sequences that a process makes at a time; they take a second or two
_LOOK = 0.2  # s, period of checking for a signal that ends the work


@dataclass(frozen=True)
class Workplace:
    """Where work is done.

    Attributes:
        jobs: number of processes on this machine.
        ray: address of a Ray cluster that is used instead, as for `completed_on`; None for none.
    """

    jobs: int
    ray: str | None = None


@dataclass(frozen=True)
class Block:
    """Consecutive sequences of a kind.

    Attributes:
        kind: of the sequences.
        seed: of the set.
        first: number of the first one within its kind.
        count: number of sequences.
    """

    kind: Kind
    seed: int
    first: int
    count: int

    def split(self) -> list[Block]:
        """Returns the parts that are made at a time, in order."""
        end = self.first + self.count
        return [
            Block(self.kind, self.seed, first, min(_TOGETHER, end - first))
            for first in range(self.first, end, _TOGETHER)
        ]


def make_block(block: Block) -> MotionArrays:
    """Makes the sequences of a block in this process."""
    numbers = range(block.first, block.first + block.count)
    return MotionArrays.of(make_sequence(block.kind, block.seed, n) for n in numbers)


def made(
    blocks: Sequence[Block],
    place: Workplace,
    stop: Interrupt,
    advance: Callable[[int], None] = lambda count: None,
) -> Iterator[tuple[Block, MotionArrays]]:
    """Yields each block with its sequences as soon as they are complete.

    Args:
        blocks: to be made; begun in this order.
        place: where.
        stop: once it is set, no more work begins, and blocks that are not complete are lost.
        advance: called with the number of sequences that have just been made.

    Raises:
        UserError: There is no such cluster.
        FailedError: A process has ended.
    """
    whole = {part: block for block in blocks for part in block.split()}
    there: dict[Block, dict[int, MotionArrays]] = {block: {} for block in blocks}
    for part, arrays in _results(list(whole), place, stop):
        advance(part.count)
        block = whole[part]
        there[block][part.first] = arrays
        if sum(len(a) for a in there[block].values()) == block.count:
            parts = there.pop(block)
            yield block, MotionArrays.joined(parts[first] for first in sorted(parts))


def _results(
    parts: Sequence[Block], place: Workplace, stop: Interrupt
) -> Iterator[tuple[Block, MotionArrays]]:
    if place.ray is not None:
        yield from completed_on(place.ray, _made_on_node, parts, stop, command=COMMAND)
    elif place.jobs == 1:
        yield from completed(make_block, parts, 1, stop)
    elif parts:
        jobs = min(place.jobs, len(parts))
        with WorkerPool(jobs) as pool:
            for part, arrays in completed(partial(_made_in, pool, stop), parts, jobs, stop):
                if arrays is not None:
                    yield part, arrays


def _made_in(pool: WorkerPool, stop: Interrupt, part: Block) -> MotionArrays | None:
    """Returns the sequences of a block; once `stop` is set, ends the processes and returns None."""
    future = pool.submit(make_block, part)
    while not wait([future], _LOOK).done and not stop.is_set():
        pass
    if stop.is_set():
        pool.kill()
        return None
    arrays: MotionArrays = answers([future])[0]
    return arrays


def _made_on_node(block: Block, _folder: Path) -> MotionArrays:
    return make_block(block)
