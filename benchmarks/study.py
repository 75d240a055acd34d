"""Runs the cases of a long study side by side; what is done is kept, and not run again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, Protocol, TypeVar

from benchmarks.kept import write_results
from drake_dress.interrupt import caught_interrupt


class _Named(Protocol):
    @property
    def name(self) -> str: ...


C = TypeVar("C", bound=_Named)


def run_missing(
    cases: Sequence[C],
    kept: dict[str, dict[str, Any]],
    run: Callable[[C], dict[str, Any]],
    told: Callable[[dict[str, Any]], str],
    jobs: int,
    path: Path | None,
) -> bool:
    """Runs the cases that are not in `kept` and puts them there; returns whether Ctrl-C ended it.

    Args:
        cases: of the study.
        kept: results by the names of their cases; one without "summary" is run again next time.
        run: one case, in a process of its own.
        told: what to print of a result.
        jobs: side by side.
        path: file in which results are kept after each, if any.
    """
    new = [case for case in cases if case.name not in kept]
    with caught_interrupt() as stop, ThreadPoolExecutor(jobs) as pool:
        pending = {pool.submit(run, case): case for case in new}
        for number, future in enumerate(as_completed(pending), 1):
            result = future.result()
            kept[pending[future].name] = result
            if path is not None:
                write_results(path, {name: r for name, r in kept.items() if "summary" in r})
            print(f"{number}/{len(new)} {pending[future].name}: {told(result)}", flush=True)
            if stop.is_set():
                pool.shutdown(wait=False, cancel_futures=True)
                break
    return stop.is_set()


def how_it_ended(result: dict[str, Any]) -> str:
    """Returns how a run ended, in a few words."""
    if "problem" in result:
        return str(result["problem"])
    return result["summary"]["reason"] or f"on in {result['summary']['dressing_time_s']:.0f} s"
