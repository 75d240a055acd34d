"""Runs the cases of a long study in parallel; results are kept and not run again."""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure
from benchmarks.kept import read_results, write_results
from benchmarks.parser import at_least_one, output_file, output_folder, some_of
from benchmarks.scenario_run import run_scenario
from benchmarks.section import add_into_option, around, write_between
from drake_dress.cluster import completed_on
from drake_dress.errors import UserError
from drake_dress.interrupt import Interrupt, caught_interrupt
from drake_dress.report.summary import read_summary
from drake_dress.side_by_side import completed


class _Named(Protocol):
    @property
    def name(self) -> str: ...


C = TypeVar("C", bound=_Named)


def add_choices(parser: argparse.ArgumentParser, **known: Collection[str]) -> None:
    """Adds an option for each keyword that takes some of its names; default: all."""
    for option, names in known.items():
        parser.add_argument(
            f"--{option}",
            type=some_of(tuple(names)),
            default=list(names),
            metavar="NAME,…",
            help=", ".join(names),
        )


def add_study_options(parser: argparse.ArgumentParser, benchmark: str, jobs: int = 2) -> None:
    """Adds the options that `carry_out` reads; by default `jobs` cases run in parallel."""
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
    add_into_option(parser, benchmark)


def dressed(summary: dict[str, Any]) -> str:
    """Returns a short text on how a dressing ended."""
    return summary["reason"] or f"on in {summary['dressing_time_s']:.0f} s"


@dataclass(frozen=True)
class Study(Generic[C]):
    """What a study runs and what it makes of the results.

    Attributes:
        name: of the benchmark.
        case_type: makes a case of its fields in a file.
        run: runs a case, with the folder to keep it in and further settings.
        tables: of results.
        figures: of results, beside what is asked.
        tell: says how a case ended, from its summary, in a few words.
    """

    name: str
    case_type: Callable[..., C]
    run: Callable[[C, Path | None, Sequence[str]], dict[str, Any]]
    tables: Callable[[Sequence[dict[str, Any]]], Sequence[Table]]
    figures: Callable[[Sequence[dict[str, Any]]], Sequence[Figure]]
    tell: Callable[[dict[str, Any]], str] = dressed


def carry_out(
    options: argparse.Namespace, study: Study[C], cases: Sequence[C], said: str = ""
) -> tuple[list[dict[str, Any]], int | None]:
    """Runs the missing cases and prints the tables.

    Args:
        options: those of `add_study_options`.
        study: what is run.
        cases: of the study.
        said: above the tables, such as which seeds they are of.

    Returns:
        The results, and the exit status if a signal ended the study.
    """
    if options.into:
        around(options.into, study.name)
    kept = {}
    if options.json is not None:
        kept = read_results(options.json, lambda case: study.case_type(**case).name, study.name)
    missing = [case for case in cases if case.name not in kept]
    if said:
        print(said)
    print(f"{len(cases)} runs, {len(missing)} of them not run yet", flush=True)
    stopped = None
    if options.keep_failures and options.keep is None:
        raise UserError("bench", "--keep-failures", "expected --keep DIR with it")
    if not options.kept:
        each = _Run(study.run, options.set, options.keep is not None, options.keep_failures)
        stopped = _run_all(each, missing, kept, options, study.tell)
    results = [kept[case.name] for case in cases if case.name in kept]
    if options.json is not None and not options.kept:
        _keep(options.json, kept, study.figures([r for r in results if "summary" in r]))
    shown = "\n\n".join(filter(None, (said, *(t.text() for t in study.tables(results) if t.rows))))
    print(f"\n{shown}", flush=True)
    if options.into:
        write_between(options.into, study.name, shown)
    return results, stopped


def exit_status(results: Sequence[dict[str, Any]], stopped: int | None) -> int:
    """Returns the status of the signal that ended the study, 1 if a run gave no result, or 0."""
    return int(any("problem" in result for result in results)) if stopped is None else stopped


@contextmanager
def place_of(case: _Named, folder: Path | None) -> Iterator[Path]:
    """Yields the folder of a case: named after it in `folder`, or a temporary one."""
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
    """Executes one `drake-dress run`; returns its case, summary and further results.

    Args:
        case: Dataclass with a name.
        scenario: Scenario file.
        folder: Folder in which the run is kept under the case's name; None to keep nothing.
        settings: KEY=VALUE settings of the scenario.
        seed: Seed of the run; None for the scenario's own.
        look: Returns further results from the run's output folder.
    """
    with place_of(case, folder) as out:
        status, problem = run_scenario(scenario, out, settings, seed, report=folder is not None)
        if problem:
            return {"case": asdict(case), "problem": problem}
        summary = read_summary(out / "summary.json")
        return {"case": asdict(case), "status": status, "summary": summary, **look(out)}


@dataclass(frozen=True)
class _Run(Generic[C]):
    """Runs a case, here or on a node; may delete the files of a successful one."""

    run: Callable[[C, Path | None, Sequence[str]], dict[str, Any]]
    settings: Sequence[str]
    kept: bool
    failures_only: bool

    def __call__(self, case: C, folder: Path | None) -> dict[str, Any]:
        folder = folder if self.kept else None
        result = self.run(case, folder, self.settings)
        if folder is not None and self.failures_only and _succeeded(result):
            shutil.rmtree(folder / case.name, ignore_errors=True)
        return result


def _completed(
    run: _Run[C], cases: Sequence[C], options: argparse.Namespace, stop: Interrupt
) -> Iterator[tuple[C, dict[str, Any]]]:
    """Yields each case with its result once it is done, on this machine or on a cluster."""
    keep: Path | None = options.keep
    if options.ray is None:
        yield from completed(lambda case: run(case, keep), cases, options.jobs, stop)
        return

    def bring(case: C, files: Mapping[str, bytes]) -> None:
        assert keep is not None
        for name, content in files.items():
            path = keep / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)

    yield from completed_on(options.ray, run, cases, stop, None if keep is None else bring)


def _succeeded(result: dict[str, Any]) -> bool:
    return bool(result.get("summary", {}).get("success", False))


def _run_all(
    run: _Run[C],
    new: Sequence[C],
    kept: dict[str, dict[str, Any]],
    options: argparse.Namespace,
    tell: Callable[[dict[str, Any]], str],
) -> int | None:
    path = options.json
    with caught_interrupt() as stop:
        for number, (case, result) in enumerate(_completed(run, new, options, stop), 1):
            kept[case.name] = result
            if path is not None:
                _keep(path, kept)
            ended = result.get("problem") or tell(result["summary"])
            print(f"{number}/{len(new)} {case.name}: {ended}", flush=True)
    return stop.status if stop.is_set() else None


def _keep(path: Path, kept: Mapping[str, dict[str, Any]], figures: Iterable[Figure] = ()) -> None:
    # what failed to run is run again
    write_results(path, {name: r for name, r in kept.items() if "summary" in r}, figures)
