"""Implements `drake-dress dataset motion`."""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from drake_dress import __version__
from drake_dress.errors import UserError
from drake_dress.file_output import claimed, remove_results, write_text
from drake_dress.interrupt import Interrupt, caught_interrupt
from drake_dress.learning.motion.card import card
from drake_dress.learning.motion.dataset import (
    CARD,
    DRESSING,
    INDEX,
    PER_FILE,
    MotionSet,
    check_origin,
    file_name,
    read_dressings,
    read_kind,
)
from drake_dress.learning.motion.dressings import Dressing, drawn_dressings, run_all
from drake_dress.learning.motion.figures import Figures, figures_of
from drake_dress.learning.motion.making import Block, Workplace, made
from drake_dress.learning.motion.motion_file import (
    MotionArrays,
    MotionFile,
    Origin,
    read_motion_file,
    write_motion,
)
from drake_dress.learning.motion.sequence import COUNT, KINDS, PERIOD, Kind

_Tell = Callable[[int, str], None]


@dataclass(frozen=True)
class Wanted:
    """The set that is asked for.

    Attributes:
        seed: of all draws.
        counts: number of sequences of each kind.
        dressings: number of whole dressings.
    """

    seed: int
    counts: Mapping[Kind, int]
    dressings: int = 0

    @property
    def command(self) -> str:
        """The command that makes it."""
        return f"drake-dress dataset motion --out DIR --seed {self.seed} {self.sizes}"

    @property
    def sizes(self) -> str:
        """Its sizes, as options of the command."""
        words = [f"--{kind} {self.counts[kind]}" for kind in KINDS]
        words += [f"--dressings {self.dressings}"] if self.dressings else []
        return " ".join(words)

    def known(self) -> MotionSet:
        """Returns what the folder holds in the end."""
        names = tuple(d.name for d in drawn_dressings(self.dressings, self.seed))
        return MotionSet(self.seed, __version__, dict(self.counts), names)

    def blocks(self) -> dict[str, Block]:
        """Returns the content of each file of sequences."""
        return {
            file_name(kind, first): Block(kind, self.seed, first, min(PER_FILE, count - first))
            for kind, count in self.counts.items()
            for first in range(0, count, PER_FILE)
        }


def write_motion_set(out: Path, wanted: Wanted, place: Workplace) -> int:
    """Makes what a folder lacks of a set of motion; returns the exit status.

    Args:
        out: folder to write to; whole files of the set that are there are kept.
        wanted: the set.
        place: where the work is done.

    Raises:
        UserError: The folder holds files of another set, or cannot be used, or there is no cluster.
        FailedError: A process or a run ended without result.
    """
    with claimed("--out", out), caught_interrupt() as stop:
        kept = _kept(out, wanted)
        blocks = {n: b for n, b in wanted.blocks().items() if n not in kept}
        runs = [d for d in drawn_dressings(wanted.dressings, wanted.seed) if d.name not in kept]
        if kept:
            print(f"files: {len(kept)} kept, {len(blocks) + len(runs)} missing", flush=True)
        if blocks or runs:
            remove_results(out, (INDEX, CARD))
        lost = _make_sequences(out, blocks, place, stop) + _run_dressings(
            out, runs, wanted.seed, place, stop
        )
        if lost:
            print(f"{stop.word}: missing files: {lost}; the same command makes them", flush=True)
            return stop.status
        known = wanted.known()
        write_text(out / CARD, _card(out, known, wanted.command))
        known.write(out)
    print(f"sequences: {sum(wanted.counts.values())}, dressings: {wanted.dressings}")
    print(f"description: {out / CARD}")
    return 0


def _kept(out: Path, wanted: Wanted) -> set[str]:
    """Returns the names of files in a folder that belong to the set and are whole.

    Raises:
        UserError: A file is of another set.
    """
    blocks = wanted.blocks()
    lengths = {name: block.count for name, block in blocks.items()}
    origins = {n: Origin(b.kind, b.seed, b.first, __version__) for n, b in blocks.items()}
    for dressing in drawn_dressings(wanted.dressings, wanted.seed):
        lengths[dressing.name] = 1
        origins[dressing.name] = Origin(DRESSING, wanted.seed, dressing.number, __version__)
    kept = set()
    for path in sorted([*out.glob("motion-*.h5"), *out.glob(f"{DRESSING}-*.h5")]):
        expected = origins.get(path.name)
        if not path.is_file():
            continue
        try:
            found = read_motion_file(path)
        except UserError as error:
            if error.key == "schema":
                raise
            if expected is not None:
                print(f"{path.name}: {error.message}; it is made again", file=sys.stderr)
            continue
        of_set = Origin(found.origin.kind, wanted.seed, found.origin.first, __version__)
        check_origin(path, found.origin, of_set if expected is None else expected)
        _check_samples(path, found)
        if expected is None or len(found.data) > lengths[path.name]:
            message = f"is of a larger set than {wanted.sizes}"
            what_to_do = "ask for as many, use another --out, or remove the file"
            raise UserError(str(path), "", f"{message}; {what_to_do}")
        if len(found.data) == lengths[path.name]:
            kept.add(path.name)
    return kept


def _check_samples(path: Path, found: MotionFile) -> None:
    """Checks that sequences have the present length: a version in development may have changed it.

    Raises:
        UserError: They have another one.
    """
    samples = found.data.joint_position.shape[1]
    if found.origin.kind != DRESSING and samples != COUNT:
        message = f"has {samples} samples a sequence, expected {COUNT}"
        what_to_do = "use another --out, or remove the file"
        raise UserError(str(path), "time", f"{message}; {what_to_do}")


def _make_sequences(
    out: Path, blocks: Mapping[str, Block], place: Workplace, stop: Interrupt
) -> int:
    """Makes and writes files of sequences; returns the number of those that are still missing."""
    total, done, names = sum(b.count for b in blocks.values()), 0, {b: n for n, b in blocks.items()}
    if not blocks or stop.is_set():
        return len(blocks)
    missing = len(blocks)
    with _progress("sequences", total, lines=False) as tell:
        for block, arrays in made(list(names), place, stop, lambda count: tell(count, "")):
            name = names[block]
            origin = Origin(block.kind, block.seed, block.first, __version__)
            write_motion(out / name, MotionFile(origin, arrays, {}))
            missing -= 1
            done += block.count
            tell(0, f"{name}: {done} of {total} sequences")
    return missing


def _run_dressings(
    out: Path, runs: Sequence[Dressing], seed: int, place: Workplace, stop: Interrupt
) -> int:
    """Runs dressings and writes their files; returns the number of those that are still missing."""
    if not runs or stop.is_set():
        return len(runs)
    done = 0
    with _progress("dressings", len(runs), lines=True) as tell:
        for dressing, content in run_all(runs, seed, place, stop):
            write_motion(out / dressing.name, content)
            done += 1
            tell(1, f"{dressing.name}: {_outcome(content)}, {done} of {len(runs)}")
    return len(runs) - done


def _outcome(content: MotionFile) -> str:
    seconds = PERIOD * (content.data.joint_position.shape[1] - 1)
    how = (
        "both sleeves on" if content.notes["dressed"] else f"not dressed: {content.notes['reason']}"
    )
    return f"{seconds:.0f} s, {how}"


def _card(out: Path, known: MotionSet, command: str) -> str:
    """Returns the text of the card."""
    figures: dict[str, Figures] = {
        kind: figures_of([read_kind(out, known, kind)]) for kind in KINDS if known.counts[kind]
    }
    by_person: dict[str, list[MotionArrays]] = defaultdict(list)
    dressed = 0
    for content in read_dressings(out, known):
        by_person[str(content.notes["person"])].append(content.data)
        dressed += bool(content.notes["dressed"])
    dressings: dict[str, Figures] = {p: figures_of(parts) for p, parts in by_person.items()}
    return card(known, command, figures, dressings, dressed)


@contextmanager
def _progress(what: str, total: int, lines: bool) -> Iterator[_Tell]:
    """Yields a function that advances by a number and tells a line.

    Args:
        what: is counted.
        total: number.
        lines: whether lines are told on a terminal, too, which has a progress bar.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _, line: print(line, file=sys.stderr, flush=True) if line else None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(what, total=total)

        def tell(count: int, line: str) -> None:
            bar.advance(task, count)
            if line and lines:
                bar.console.print(line, highlight=False)

        yield tell
