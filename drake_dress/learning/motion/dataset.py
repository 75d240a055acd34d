"""A set of sequences in a folder: the names of its files, its parts, and reading it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from drake_dress.errors import UserError
from drake_dress.file_output import write_text
from drake_dress.learning.motion.motion_file import (
    SCHEMA,
    MotionArrays,
    MotionFile,
    Origin,
    read_motion_file,
)
from drake_dress.learning.motion.sequence import KINDS, PERIOD, Kind
from drake_dress.models.arrays import FloatArray, IndexArray

PER_FILE = 50  # sequences
# Files that say what a set is: for people, and for `read_motion`. They are written last.
CARD, INDEX = "card.md", "motion.json"
DRESSING = "dressing"

Part = Literal["training", "validation", "test"]
PARTS: tuple[Part, ...] = ("training", "validation", "test")
# Shares of the sequences of a kind; all others are for training.
VALIDATION_SHARE, TEST_SHARE = 0.10, 0.15


def part_range(part: Part, count: int) -> range:
    """Returns the numbers of a part's sequences among the `count` sequences of a kind.

    The last 15 % are for the test, and the 10 % before them for validation. Sequences are drawn
    independently of each other, so no person occurs in two parts.
    """
    test = count - round(TEST_SHARE * count)
    validation = test - round(VALIDATION_SHARE * count)
    starts = {"training": (0, validation), "validation": (validation, test), "test": (test, count)}
    return range(*starts[part])


def file_name(kind: Kind, first: int) -> str:
    """Returns the name of the file whose first sequence has number `first` within its kind."""
    return f"motion-{kind}-{first:05d}.h5"


@dataclass(frozen=True)
class MotionSet:
    """What a folder holds.

    Attributes:
        seed: of all draws.
        version: of drake_dress.
        counts: number of sequences of each kind.
        dressings: names of the files of whole dressings.
    """

    seed: int
    version: str
    counts: dict[Kind, int]
    dressings: tuple[str, ...] = ()

    def origin(self, kind: Kind, first: int) -> Origin:
        """Returns the origin of the file that begins with number `first` of a kind."""
        return Origin(kind, self.seed, first, self.version)

    def write(self, directory: Path) -> None:
        """Writes the index, which makes the set readable."""
        text = json.dumps({"schema": SCHEMA, **asdict(self)}, indent=1)
        write_text(directory / INDEX, text + "\n")


def read_index(directory: Path) -> MotionSet:
    """Returns what a folder holds.

    Raises:
        UserError: There is no complete set of motion in the folder.
    """
    path = directory / INDEX
    try:
        said = json.loads(path.read_text(encoding="utf-8"))
        if said["schema"] != SCHEMA:
            raise UserError(str(path), "schema", f"is {said['schema']!r}, expected {SCHEMA!r}")
        counts = {kind: int(said["counts"].get(kind, 0)) for kind in KINDS}
        return MotionSet(int(said["seed"]), said["version"], counts, tuple(said["dressings"]))
    except FileNotFoundError as error:
        message = "no such file, expected a complete set of `drake-dress dataset motion`"
        raise UserError(str(path), "", message) from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        if isinstance(error, UserError):
            raise
        message = f"cannot be used, expected the index of a set of motion: {error}"
        raise UserError(str(path), "", message) from error


@dataclass(frozen=True)
class MotionData:
    """Sequences of one part of a set.

    Attributes:
        kind: (n,) index into `KINDS`.
        number: (n,) of each sequence within its kind.
        time: (T,) s.
        joint_position: (n,T,6,3) shoulder, elbow, hand of left, then of right arm, m, world.
        sleeve: (n,T,2,6) centre, m, and unit direction from cuff to armhole, of left and right
            armhole, world; NaN without a garment.
        intent: (n,T,2) 1 where the arm moves by the person's own will, else 0; left, right.
        on: (n,T,2) 1 where the arm is in its sleeve, else 0; left, right.
    """

    kind: IndexArray
    number: IndexArray
    time: FloatArray
    joint_position: npt.NDArray[np.float32]
    sleeve: npt.NDArray[np.float32]
    intent: npt.NDArray[np.uint8]
    on: npt.NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.number)


def read_motion(
    directory: str | Path, kinds: Sequence[Kind] = KINDS, part: Part = "training"
) -> MotionData:
    """Returns the sequences of a part of a set, by kind and number.

    Args:
        directory: folder that `drake-dress dataset motion` wrote.
        kinds: kinds of sequences.
        part: `training`, `validation` or `test`; see `part_range`.

    Raises:
        UserError: The set is incomplete, a file is missing, damaged, or does not belong to the set,
            or the part has no sequence.
    """
    folder = Path(directory)
    known = read_index(folder)
    parts, kind_of, number = [], [], []
    for kind in kinds:
        wanted = part_range(part, known.counts[kind])
        if len(wanted):
            parts.append(_read_kind(folder, known, kind, wanted))
            kind_of += len(wanted) * [KINDS.index(kind)]
            number += list(wanted)
    if not parts:
        message = f"has no sequence for {part} of {', '.join(kinds) or 'no kind'}"
        raise UserError(str(folder / INDEX), "counts", f"{message}, expected more sequences")
    data = MotionArrays.joined(parts)
    time = PERIOD * np.arange(data.joint_position.shape[1], dtype=np.float64)
    return MotionData(np.array(kind_of), np.array(number), time, **data.arrays())


def read_kind(directory: Path, known: MotionSet, kind: Kind) -> MotionArrays:
    """Returns all sequences of a kind, of which there is at least one.

    Raises:
        UserError: A file is missing, damaged, or does not belong to the set.
    """
    return _read_kind(directory, known, kind, range(known.counts[kind]))


def read_dressings(directory: str | Path, known: MotionSet | None = None) -> list[MotionFile]:
    """Returns the whole dressings of a set, each a file with one sequence of its own length.

    Attributes of a run are in `notes`: `person`, `run_seed`, `dressed`, `reason`, `scenario`.

    Args:
        directory: folder that `drake-dress dataset motion` wrote.
        known: what it holds; by default it is read from the folder.

    Raises:
        UserError: The set is incomplete, or a file is missing, damaged, or does not belong to it.
    """
    folder = Path(directory)
    known = read_index(folder) if known is None else known
    found = []
    for number, name in enumerate(known.dressings):
        content = read_motion_file(folder / name)
        check_origin(
            folder / name, content.origin, Origin(DRESSING, known.seed, number, known.version)
        )
        found.append(content)
    return found


def check_origin(path: Path, found: Origin, expected: Origin) -> None:
    """Checks that a file belongs to a set.

    Raises:
        UserError: It is of another seed, version, kind or place; the message says what to do.
    """
    for key, value in vars(expected).items():
        came = getattr(found, key)
        if came != value:
            message = f"is {came}, expected {value}; use another --out, or remove the file"
            raise UserError(str(path), key, message)


def _read_kind(folder: Path, known: MotionSet, kind: Kind, wanted: range) -> MotionArrays:
    """Returns the sequences with the numbers `wanted`, of which there is at least one."""
    parts = []
    for first in range(wanted.start // PER_FILE * PER_FILE, wanted.stop, PER_FILE):
        path = folder / file_name(kind, first)
        start, stop = max(wanted.start - first, 0), min(wanted.stop - first, PER_FILE)
        content = read_motion_file(path, slice(start, stop))
        check_origin(path, content.origin, known.origin(kind, first))
        if len(content.data) != stop - start:
            message = f"has {start + len(content.data)} sequences, expected {stop} or more"
            raise UserError(str(path), "joint_position", message)
        parts.append(content.data)
    return MotionArrays.joined(parts)
