"""Runs the tests of a module on a mutant, in a copy of the repository."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.mutation.modules import Module

CAUGHT, SURVIVED, TIMED_OUT = "caught", "survived", "timed out"
_COPIED = ("drake_dress", "benchmarks", "tests", "scenarios", "pyproject.toml")
# Of pytest: all passed; some failed; it was interrupted, as by an error while collecting.
_PASSED, _FAILED, _INTERRUPTED = 0, 1, 2


@contextmanager
def copied(root: Path) -> Iterator[Path]:
    """Gives a copy of the repository, kernels that are compiled already among it."""
    with TemporaryDirectory(prefix="mutation-") as directory:
        for name in _COPIED:
            if (root / name).is_dir():
                # with its times: Numba takes a kernel from its cache if its file is as old
                shutil.copytree(root / name, Path(directory) / name)
            else:
                shutil.copy2(root / name, directory)
        yield Path(directory)


def tried(module: Module, copy: Path) -> tuple[str, float]:
    """Returns what the tests of a module say of the copy, and how long they took, s.

    Numba compiles a file anew that has changed, but not what calls it from other files: tests are
    those of the file itself.

    Raises:
        RuntimeError: pytest says neither that tests passed nor that they failed.
    """
    begin = time.perf_counter()
    environment = os.environ | {
        "PYTHONPATH": str(copy),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
        # the same draws for all mutants
        "DRAKE_DRESS_TEST_SEED": "0",
    }
    words = [sys.executable, "-m", "pytest", "-x", "-q", "--hypothesis-seed=0", *module.tests]
    process = subprocess.Popen(
        words,
        cwd=copy,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        told, _ = process.communicate(timeout=module.timeout)
    except subprocess.TimeoutExpired:
        return TIMED_OUT, time.perf_counter() - begin
    finally:
        # what a test has started, too
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
    spent = time.perf_counter() - begin
    if process.returncode == _PASSED:
        return SURVIVED, spent
    # a signal: the mutant crashed the interpreter
    if process.returncode in (_FAILED, _INTERRUPTED) or process.returncode < 0:
        return CAUGHT, spent
    raise RuntimeError(f"pytest ended with {process.returncode}:\n{told[-2000:]}")
