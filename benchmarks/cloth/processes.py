"""Measures scenes in this process or in several worker processes."""

from __future__ import annotations

import importlib
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from benchmarks.cloth.measure import Session
from drake_dress.interrupt import caught_interrupt

Result = dict[str, Any]


def scene_module(name: str) -> Any:
    """Returns the module of a scene, with `measure`, `tables` and `write_figures`."""
    return importlib.import_module(f"benchmarks.cloth.{name}")


def measure_in_turn(
    names: Sequence[str],
    quick: bool,
    limit: float,
    cache: Path | None,
    engines: tuple[str, ...],
    stop: threading.Event,
    finish: Callable[[str, Result], None],
) -> None:
    """Measures scenes one after the other and passes each result to `finish`."""
    session = Session(quick, limit, cache, _say, stop, engines)
    for name in names:
        if stop.is_set():
            break
        finish(name, scene_module(name).measure(session))


def measure_at_once(
    jobs: int,
    names: Sequence[str],
    quick: bool,
    limit: float,
    cache: Path | None,
    engines: tuple[str, ...],
    stop: threading.Event,
    finish: Callable[[str, Result], None],
) -> None:
    """Measures scenes in `jobs` parallel processes, which disturb each other's times.

    Ctrl-C reaches all processes of a terminal, and each ends with its results so far.
    """
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        pending = {
            name: pool.submit(measure_alone, name, quick, limit, cache, engines) for name in names
        }
        for name, future in pending.items():
            if not (stop.is_set() and future.cancel()):
                finish(name, future.result())


def measure_alone(
    name: str, quick: bool, limit: float, cache: Path | None, engines: tuple[str, ...]
) -> Result:
    """Measures one scene; the task of a worker process."""
    with caught_interrupt() as stop:
        session = Session(quick, limit, cache, _say, stop, engines)
        result: Result = scene_module(name).measure(session)
    return result


def _say(line: str) -> None:
    print(line, flush=True)
