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
# Exit codes of pytest: all passed; some failed; interrupted, e.g. by a collection error.
_PASSED, _FAILED, _INTERRUPTED = 0, 1, 2


@contextmanager
def copied(root: Path) -> Iterator[Path]:
    """Yields a copy of the repository, including compiled kernels."""
    with TemporaryDirectory(prefix="mutation-") as directory:
        for name in _COPIED:
            if (root / name).is_dir():
                # with time stamps: Numba reuses a cached kernel only if its file's time is the same
                shutil.copytree(root / name, Path(directory) / name)
            else:
                shutil.copy2(root / name, directory)
        yield Path(directory)


def tried(module: Module, copy: Path) -> tuple[str, float]:
    """Runs the tests of a module on the copy; returns the result and the duration, s.

    Numba recompiles a changed file, but not its callers in other files. Therefore, the tests must
    be those of the file itself.

    Raises:
        RuntimeError: pytest reports neither success nor failure.
    """
    begin = time.perf_counter()
    environment = os.environ | {
        "PYTHONPATH": str(copy),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
        # the same random cases for all mutants
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
        # end the processes that a test has started, too
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
    spent = time.perf_counter() - begin
    if process.returncode == _PASSED:
        return SURVIVED, spent
    # negative: ended by a signal, since the mutant crashed the interpreter
    if process.returncode in (_FAILED, _INTERRUPTED) or process.returncode < 0:
        return CAUGHT, spent
    raise RuntimeError(f"pytest ended with {process.returncode}:\n{told[-2000:]}")
