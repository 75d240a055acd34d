"""Runs the cases of a long study side by side; what is done is kept, and not run again."""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from benchmarks.cloth.table import Table
from benchmarks.cluster import completed_on
from benchmarks.kept import read_results, write_results
from benchmarks.parser import at_least_one, output_file, output_folder, some_of
from benchmarks.scenario_run import run_scenario
from benchmarks.section import END, around, begin, write_between
from benchmarks.side_by_side import completed
from drake_dress.errors import UserError
from drake_dress.interrupt import Interrupt, caught_interrupt
from drake_dress.report.summary import read_summary


class _Named(Protocol):
    @property
    def name(self) -> str: ...


C = TypeVar("C", bound=_Named)


def add_choices(parser: argparse.ArgumentParser, **known: Collection[str]) -> None:
    """Adds an option for each keyword, that takes some of its names; all by default."""
    for option, names in known.items():
        parser.add_argument(
            f"--{option}",
            type=some_of(tuple(names)),
            default=list(names),
            metavar="NAME,…",
            help=", ".join(names),
        )


def add_study_options(parser: argparse.ArgumentParser, benchmark: str, jobs: int = 2) -> None:
    """Adds the options that `carry_out` reads; `jobs` run side by side by default."""
    parser.add_argument(
        "--jobs",
        type=at_least_one,
        default=jobs,
        metavar="N",
        help=f"runs side by side; default {jobs}",
    )
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument(
        "--keep", type=output_folder, metavar="DIR", help="keep logs, reports and replays"
    )
    parser.add_argument(
        "--keep-failures", action="store_true", help="keep those of runs that did not succeed"
    )
    parser.add_argument(
        "--ray",
        metavar="ADDRESS",
        help="run on a Ray cluster: auto, its address, or local to start one here",
    )
    parser.add_argument("--json", type=output_file, metavar="FILE", help="results, resumed from")
    parser.add_argument("--kept", action="store_true", help="run nothing; tables of what is there")
    parser.add_argument(
        "--into",
        type=Path,
        metavar="FILE.md",
        help=f"put the tables between {begin(benchmark)} and {END}",
    )


def dressed(summary: dict[str, Any]) -> str:
    """Returns how a dressing ended, in a few words."""
    return summary["reason"] or f"on in {summary['dressing_time_s']:.0f} s"


def carry_out(
    options: argparse.Namespace,
    benchmark: str,
    case_type: Callable[..., C],
    cases: Sequence[C],
    run: Callable[[C, Path | None, Sequence[str]], dict[str, Any]],
    tables: Callable[[Sequence[dict[str, Any]]], Sequence[Table]],
    tell: Callable[[dict[str, Any]], str] = dressed,
    said: str = "",
) -> tuple[list[dict[str, Any]], int | None]:
    """Runs what is missing and prints the tables.

    Args:
        options: those of `add_study_options`.
        benchmark: its name.
        case_type: makes a case of its fields in a file.
        cases: of the study.
        run: a case, with the folder to keep it in and further settings.
        tables: of results.
        tell: how a case ended, from its summary, in a few words.
        said: above the tables, such as which seeds they are of.

    Returns:
        The results, and the exit status if a signal ended the study.
    """
    if options.into:
        around(options.into, benchmark)
    kept = {}
    if options.json is not None:
        kept = read_results(options.json, lambda case: case_type(**case).name, benchmark)
    missing = [case for case in cases if case.name not in kept]
    if said:
        print(said)
    print(f"{len(cases)} runs, {len(missing)} of them not run yet", flush=True)
    stopped = None
    if options.keep_failures and options.keep is None:
        raise UserError("bench", "--keep-failures", "expected --keep DIR with it")
    if not options.kept:
        stopped = _run_all(_Runs(run, options), missing, kept, tell)
    results = [kept[case.name] for case in cases if case.name in kept]
    shown = "\n\n".join(filter(None, (said, *(t.text() for t in tables(results) if t.rows))))
    print(f"\n{shown}", flush=True)
    if options.into:
        write_between(options.into, benchmark, shown)
    return results, stopped


def exit_status(results: Sequence[dict[str, Any]], stopped: int | None) -> int:
    """Returns the status of the signal that ended the study, 1 if a run could not be used, or 0."""
    return int(any("problem" in result for result in results)) if stopped is None else stopped


@contextmanager
def place_of(case: _Named, folder: Path | None) -> Iterator[Path]:
    """Provides the folder of a case: of its name in `folder`, or one that is kept no longer."""
    if folder is not None:
        yield folder / case.name
        return
    with tempfile.TemporaryDirectory() as place:
        yield Path(place)


def run_case(
    case: Any,
    scenario: Path,
    folder: Path | None,
    settings: Sequence[str],
    seed: int | None = None,
    look: Callable[[Path], dict[str, Any]] = lambda out: {},
) -> dict[str, Any]:
    """Returns what one `drake-dress run` came to: case, summary, and what else is looked at.

    Args:
        case: a dataclass with a name.
        scenario: file.
        folder: in which it is kept under the case's name; None to keep nothing.
        settings: KEY=VALUE for the scenario.
        seed: of the run; None for the scenario's own.
        look: what to take from the folder that it wrote.
    """
    with place_of(case, folder) as out:
        status, problem = run_scenario(scenario, out, settings, seed, report=folder is not None)
        if problem:
            return {"case": asdict(case), "problem": problem}
        summary = read_summary(out / "summary.json")
        return {"case": asdict(case), "status": status, "summary": summary, **look(out)}


@dataclass(frozen=True)
class _Runs(Generic[C]):
    """Runs cases on this machine or on a cluster, and keeps the files that are wanted."""

    run: Callable[[C, Path | None, Sequence[str]], dict[str, Any]]
    options: argparse.Namespace

    def completed(self, cases: Sequence[C], stop: Interrupt) -> Iterator[tuple[C, dict[str, Any]]]:
        """Yields each case with its result as soon as it is done."""
        keep, settings = self.options.keep, tuple(self.options.set)
        if self.options.ray is None:
            for case, result in completed(self._here, cases, self.options.jobs, stop):
                if keep is not None and not self._keeps(result):
                    shutil.rmtree(keep / case.name, ignore_errors=True)
                yield case, result
            return
        afar = _Afar(self.run, settings, keep is not None, self.options.keep_failures)
        bring = None if keep is None else self._bring
        yield from completed_on(self.options.ray, afar, cases, stop, bring)

    def _here(self, case: C) -> dict[str, Any]:
        return self.run(case, self.options.keep, self.options.set)

    def _keeps(self, result: dict[str, Any]) -> bool:
        return not self.options.keep_failures or not _succeeded(result)

    def _bring(self, case: C, files: Mapping[str, bytes]) -> None:
        for name, content in files.items():
            path = self.options.keep / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)


@dataclass(frozen=True)
class _Afar(Generic[C]):
    """Runs a case on a node; what is not kept is left out of its folder."""

    run: Callable[[C, Path | None, Sequence[str]], dict[str, Any]]
    settings: tuple[str, ...]
    kept: bool
    failures_only: bool

    def __call__(self, case: C, folder: Path) -> dict[str, Any]:
        result = self.run(case, folder if self.kept else None, self.settings)
        if self.failures_only and _succeeded(result):
            shutil.rmtree(folder / case.name, ignore_errors=True)
        return result


def _succeeded(result: dict[str, Any]) -> bool:
    return bool(result.get("summary", {}).get("success", False))


def _run_all(
    runs: _Runs[C],
    new: Sequence[C],
    kept: dict[str, dict[str, Any]],
    tell: Callable[[dict[str, Any]], str],
) -> int | None:
    path = runs.options.json
    with caught_interrupt() as stop:
        for number, (case, result) in enumerate(runs.completed(new, stop), 1):
            kept[case.name] = result
            if path is not None:
                # what failed to run is run again
                write_results(path, {name: r for name, r in kept.items() if "summary" in r})
            ended = result.get("problem") or tell(result["summary"])
            print(f"{number}/{len(new)} {case.name}: {ended}", flush=True)
    return stop.status if stop.is_set() else None
