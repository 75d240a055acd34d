"""A random input, its expected outcome, and its result."""

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

# Greatest length of a readable line, characters.
LONGEST_LINE = 720


class Expect(StrEnum):
    """Expected outcome of an input."""

    REFUSE = "refuse"  # it contains something impossible
    ACCEPT = "accept"  # it is valid, only in another notation
    EITHER = "either"  # it may be refused; if accepted, it must pass the trial's own check


class Outcome(StrEnum):
    """Actual outcome of an input."""

    REFUSED = "refused"
    ACCEPTED = "accepted"
    TRACEBACK = "traceback"
    SILENT = "silent"  # no answer within the limit
    DIED = "died"  # the process ended


@dataclass(frozen=True)
class Trial:
    """A random input.

    Attributes:
        mutation: Description of the mutation and its drawn values.
        expect: Expected outcome.
        use: Reads the input with the program. Raises UserError if it is refused; otherwise returns
            what is wrong with the accepted result, None if nothing is.
    """

    mutation: str
    expect: Expect
    use: Callable[[], str | None]


@dataclass(frozen=True)
class Result:
    """Result of a trial.

    Attributes:
        index: Index of the trial, which draws it again with the same seed.
        kind: Kind of input.
        mutation, expect: As in the trial.
        outcome: Actual outcome.
        told: Message of the refusal, or the last lines of the traceback.
        seconds: Duration, s.
        problem: Why this is a failure; None if the outcome is correct.
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
    """Runs a trial in this process and returns its result."""
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
    """Captures standard output and error, also of C libraries, and Python warnings."""
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
    """Returns the folder for this process's input files."""
    folder = Path(tempfile.gettempdir()) / f"drake-dress-inputs-{os.getpid()}"
    folder.mkdir(exist_ok=True)
    return folder
