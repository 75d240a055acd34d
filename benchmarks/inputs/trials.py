"""One drawn input: how it was made, what has to become of it, and what did."""

from __future__ import annotations

import os
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from drake_dress.errors import UserError

# One line of at most this many characters can be read.
LONGEST_LINE = 720


class Expect(StrEnum):
    """What has to become of an input."""

    REFUSE = "refuse"  # it holds something impossible
    ACCEPT = "accept"  # it is sound, only written in another way
    EITHER = "either"  # it may be refused; what is accepted must pass the trial's own check


class Outcome(StrEnum):
    """What became of an input."""

    REFUSED = "refused"
    ACCEPTED = "accepted"
    TRACEBACK = "traceback"
    SILENT = "silent"  # no answer within the limit
    DIED = "died"  # the process ended


@dataclass(frozen=True)
class Trial:
    """A drawn input.

    Attributes:
        mutation: how it was made, in a word and its drawn values.
        expect: what has to become of it.
        use: has the program read it; raises UserError where it is refused, and returns what is
            wrong with a result that was accepted, None if nothing is.
    """

    mutation: str
    expect: Expect
    use: Callable[[], str | None]


@dataclass(frozen=True)
class Result:
    """What became of a trial.

    Attributes:
        index: of the trial, which draws it again with the same seed.
        kind: of input.
        mutation, expect: of the trial.
        outcome: what became of it.
        told: the line it was refused with, or the traceback's last lines.
        seconds: it took.
        problem: why this is a failure; None where it is as it has to be.
    """

    index: int
    kind: str
    mutation: str
    expect: str
    outcome: str
    told: str
    seconds: float
    problem: str | None


def carry_out(index: int, kind: str, trial: Trial) -> Result:
    """Returns what becomes of a trial in this process."""
    begin = time.perf_counter()
    wrong: str | None = None
    with _captured_output() as written:
        try:
            wrong = trial.use()
            outcome, told = Outcome.ACCEPTED, ""
        except UserError as error:
            outcome, told = Outcome.REFUSED, f"drake-dress: {error}"
        except Exception as error:
            lines = traceback.format_exception(error)
            outcome, told = Outcome.TRACEBACK, "".join(lines[-3:])
    seconds = time.perf_counter() - begin
    problem = _problem(trial.expect, outcome, told, wrong, written())
    return Result(index, kind, trial.mutation, trial.expect, outcome, told, seconds, problem)


def _problem(
    expect: Expect, outcome: Outcome, told: str, wrong: str | None, written: str
) -> str | None:
    if outcome is Outcome.TRACEBACK:
        return "traceback"
    if written.strip():
        return f"wrote beside its line: {written.strip()[:200]!r}"
    if outcome is Outcome.REFUSED:
        if len(told.splitlines()) != 1:
            return "refused in several lines"
        if len(told) > LONGEST_LINE:
            return f"refused in a line of {len(told)} characters"
        if expect is Expect.ACCEPT:
            return "refused though sound"
        return None
    if expect is Expect.REFUSE:
        return "accepted though impossible"
    return f"accepted with a wrong result: {wrong}" if wrong else None


@contextmanager
def _captured_output() -> Iterator[Callable[[], str]]:
    """Provides what was written to standard output and error, by libraries in C too, and warned."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(1), os.dup(2)]
    text: list[str] = []
    with tempfile.TemporaryFile("w+", errors="replace") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
        try:
            with (
                redirect_stdout(file),
                redirect_stderr(file),
                warnings.catch_warnings(record=True) as warned,
            ):
                warnings.simplefilter("default")
                yield lambda: "".join(text)
        finally:
            file.flush()
            for k, descriptor in enumerate(kept, start=1):
                os.dup2(descriptor, k)
                os.close(descriptor)
            file.seek(0)
            text += [file.read(), *(f"{w.category.__name__}: {w.message}" for w in warned)]


def place() -> Path:
    """Returns the folder that this process may write its inputs to."""
    folder = Path(tempfile.gettempdir()) / f"drake-dress-inputs-{os.getpid()}"
    folder.mkdir(exist_ok=True)
    return folder
